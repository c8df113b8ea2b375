"""Heat maps: the similarity of a cloud as colours, and painted over the views it came from."""

import numpy as np
from matplotlib import colormaps
from PIL import Image, ImageDraw
from scipy.spatial import KDTree

from perception.cloud import FeatureCloud
from perception.views import CameraView

_PIXELS_LOOKED_UP = 120_000
_LOW_PERCENTILE, _HIGH_PERCENTILE = 2.0, 99.5
_OPACITY = 0.6
_MARK_SHARE = 0.012  # of the image's width


def heat_colors(similarity: np.ndarray) -> np.ndarray:
    """Colour similarities from blue (the least of these) to red (the most).

    Args:
        similarity: (N,) similarities.

    Returns:
        (N, 3) uint8; the colours are stretched between the 2nd and the 99.5th percentile.
    """
    if similarity.size == 0:
        return np.zeros((0, 3), np.uint8)
    low, high = np.percentile(similarity, [_LOW_PERCENTILE, _HIGH_PERCENTILE])
    scaled = np.clip((similarity - low) / max(high - low, 1e-6), 0.0, 1.0)
    return (colormaps["turbo"](scaled)[:, :3] * 255).astype(np.uint8)


def paint_heatmap(
    view: CameraView,
    cloud: FeatureCloud,
    *,
    reach_m: float,
    marked_point: np.ndarray | None = None,
) -> np.ndarray:
    """Paint the similarity of a cloud over a view.

    Every pixel with depth takes the colour of the nearest point of the cloud, so nothing shines
    through what hides it; pixels without one nearby stay grey.

    Args:
        view: The view.
        cloud: Cloud with similarities.
        reach_m: Farthest distance of a pixel's own point from the point whose colour it takes.
        marked_point: (3,) a point of the world to be marked with a cross where the view sees it;
            None for none.

    Returns:
        (H, W, 3) uint8.
    """
    grey = view.rgb.mean(axis=2).astype(np.uint8)[..., None].repeat(3, axis=2)
    height, width = view.depth_m.shape
    step = max(1, int(np.ceil(np.sqrt(height * width / _PIXELS_LOOKED_UP))))
    v, u = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    depth_m = view.depth_m[v, u]
    is_valid = depth_m > 0
    pixels = np.stack([u[is_valid], v[is_valid]], axis=1).astype(np.float32)
    distances, nearest = KDTree(cloud.points).query(
        view.unproject(pixels, depth_m[is_valid]), distance_upper_bound=reach_m
    )
    is_near, nearest = np.isfinite(distances), np.asarray(nearest)
    coarse = np.zeros((*depth_m.shape, 3), np.float32)
    weight = np.zeros(depth_m.shape, np.float32)
    rows, columns = (index[is_near] for index in np.nonzero(is_valid))
    coarse[rows, columns] = heat_colors(cloud.similarity)[nearest[is_near]]
    weight[rows, columns] = _OPACITY
    # Each looked-up pixel stands for the square around it.
    row = np.minimum(np.arange(height) // step, depth_m.shape[0] - 1)[:, None]
    column = np.minimum(np.arange(width) // step, depth_m.shape[1] - 1)[None]
    share = weight[row, column][..., None]
    painted = (share * coarse[row, column] + (1.0 - share) * grey).astype(np.uint8)
    if marked_point is None or not is_seen(view, marked_point, reach_m):
        return painted
    return _marked(painted, view, marked_point)


def is_seen(view: CameraView, point: np.ndarray, tolerance_m: float) -> bool:
    """Tell whether a view sees a point: inside the image, and nothing measured in front of it.

    Args:
        view: The view.
        point: (3,) world coordinates, metres.
        tolerance_m: How far before the point the measured depth may lie.

    Returns:
        Whether it does; not where nothing was measured.
    """
    (pixel,), (depth,) = view.project(np.asarray(point, np.float64)[None])
    if not depth > 0:
        return False
    u, v = np.rint(pixel).astype(int)
    height, width = view.depth_m.shape
    if not (0 <= u < width and 0 <= v < height):
        return False
    measured = view.depth_m[v, u]
    return bool(measured > 0 and measured > depth - tolerance_m)


def _marked(picture: np.ndarray, view: CameraView, point: np.ndarray) -> np.ndarray:
    (pixel,), _ = view.project(np.asarray(point, np.float64)[None])
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    u, v = (float(c) for c in pixel)
    radius = max(4.0, _MARK_SHARE * image.width)
    for color, line_width in (((0, 0, 0), 6), ((255, 255, 255), 2)):
        for du, dv in ((radius, 0), (0, radius)):
            draw.line([(u - du, v - dv), (u + du, v + dv)], fill=color, width=line_width)
    return np.array(image)
