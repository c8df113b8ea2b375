"""Windows over an image at two scales, and the blending of their feature maps into one."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor


@dataclass(frozen=True, kw_only=True)
class Window:
    """A part of an image in relative coordinates, 0..1 along each axis; aspect ratio kept.

    Attributes:
        top: Upper edge, as a share of the image's height.
        left: Left edge, as a share of the image's width.
        size: Share of the height, and of the width, that it covers.
    """

    top: float
    left: float
    size: float


def image_windows(num_tiles: int, overlap: float) -> tuple[Window, ...]:
    """Return the whole image, then evenly spread tiles.

    Args:
        num_tiles: Tiles along each side; below 2 the whole image is the only window.
        overlap: Share of a tile's length that its neighbour sees too.

    Returns:
        The windows.
    """
    whole = Window(top=0.0, left=0.0, size=1.0)
    n = num_tiles
    if n < 2:
        return (whole,)
    size = 1.0 / (n - (n - 1) * overlap)
    step = (1.0 - size) / (n - 1)
    tiles = (Window(top=i * step, left=j * step, size=size) for i in range(n) for j in range(n))
    return (whole, *tiles)


def blend(
    features: Float[Tensor, "windows v h w c"],
    windows: Sequence[Window],
    size: tuple[int, int],
) -> Float[Tensor, "v height width c"]:
    """Resample the maps of all windows onto one map of the image, and add them.

    A tile's weight falls towards its rim, where patches lack context, and so hides its seams. The
    sum is not divided by the weights: features are directions, and are normalised afterwards.

    Args:
        features: Maps of all windows.
        windows: Where they lie.
        size: Height and width of the map to make.

    Returns:
        Weighted sums.
    """
    num_windows, num_views, *_, channels = features.shape
    total = torch.zeros(num_views, *size, channels)
    for index in range(num_windows):
        window = windows[index]
        down, first_row = _resampling(size[0], window.top, window.size, features.shape[2])
        across, first_column = _resampling(size[1], window.left, window.size, features.shape[3])
        rows = torch.einsum("yh,vhwc->vywc", down, features[index])
        part = torch.einsum("xw,vywc->vyxc", across, rows)
        bottom, right = first_row + len(down), first_column + len(across)
        total[:, first_row:bottom, first_column:right] += part
    return total


def _resampling(num_cells: int, start: float, size: float, num_inputs: int) -> tuple[Tensor, int]:
    """Return (cells, num_inputs) weights of linear interpolation, and the first cell they are for.

    Only the cells whose centres lie inside the window are there; weights are tapered for tiles.
    """
    centers = ((torch.arange(num_cells) + 0.5) / num_cells - start) / size
    inside = torch.nonzero((centers > 0.0) & (centers < 1.0)).flatten()
    centers = centers[inside]
    position = (centers * num_inputs - 0.5).clamp(0.0, num_inputs - 1.0)
    distance = (position[:, None] - torch.arange(num_inputs)).abs()
    weights = (1.0 - distance).clamp(min=0.0)
    if size < 1.0:
        weights *= (1.0 - (2.0 * centers - 1.0).abs())[:, None]
    return weights, int(inside[0])
