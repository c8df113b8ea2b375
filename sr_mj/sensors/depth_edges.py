"""Geometry of a perfect depth image: depth edges, and the angle at which a ray meets a surface."""

import numpy as np

from models.cameras import PinholeSensor


def find_depth_edges(depth_m: np.ndarray, step_ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the pixels on both sides of every depth edge.

    Args:
        depth_m: (H, W) float32, metres along the optical axis, 0 = no return.
        step_ratio: Neighbours in a row or column form an edge if their depths differ by more than
            this share of the smaller one; so a pixel beside one without return is on an edge.

    Returns:
        Flat indices (E,) of the pixels, ascending and unique, and for each the flat index (E,) of
        a neighbour across the edge.
    """
    width = depth_m.shape[1]
    pairs = []
    for offset, first, second in (
        (1, depth_m[:, :-1], depth_m[:, 1:]),
        (width, depth_m[:-1], depth_m[1:]),
    ):
        is_step = np.abs(second - first) > step_ratio * np.minimum(first, second)
        row, column = np.divmod(np.flatnonzero(is_step), first.shape[1])
        index = row * width + column
        pairs += [(index, index + offset), (index + offset, index)]
    pixels = np.concatenate([pair[0] for pair in pairs])
    across = np.concatenate([pair[1] for pair in pairs])
    unique, where = np.unique(pixels, return_index=True)
    return unique, across[where]


def incidence_cosine(depth_m: np.ndarray, sensor: PinholeSensor) -> np.ndarray:
    """Compute the cosine of the angle between each pixel's ray and the surface normal.

    On a plane n . X = d the inverse depth is linear in the image: with the ray r = (x, y, 1), x =
    (u - cx) / fx, y = (v - cy) / fy, we have 1 / z = (n . r) / d. Its gradient thus gives the
    normal, n / d = (a, b, 1 / z - a x - b y), exactly and without a fit. Of the differences to
    the left and to the right the smaller one counts, so that edges do not look like slopes.

    Args:
        depth_m: (H, W) float32, metres along the optical axis, 0 = no return.
        sensor: The pinhole model.

    Returns:
        (H, W) float32, 1 for a surface seen face on, 0 for one seen edge on; NaN where there is
        no return.
    """
    height, width = depth_m.shape
    x = ((np.arange(width) - sensor.cx) / sensor.fx).astype(np.float32)
    y = ((np.arange(height) - sensor.cy) / sensor.fy).astype(np.float32)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.reciprocal(depth_m)
        a = _gentlest_difference(inverse.T).T * np.float32(sensor.fx)
        b = _gentlest_difference(inverse) * np.float32(sensor.fy)
        c = inverse - a * x - b * y
        squared_norm = (a * a + b * b + c * c) * (x * x + y * y + 1)
        return inverse / np.sqrt(squared_norm)


def _gentlest_difference(image: np.ndarray) -> np.ndarray:
    """Differentiate along the first axis: the forward or backward difference nearer to zero."""
    steps = np.diff(image, axis=0)
    backward = np.concatenate([steps[:1], steps])
    forward = np.concatenate([steps, steps[-1:]])
    return np.where(np.abs(backward) <= np.abs(forward), backward, forward)
