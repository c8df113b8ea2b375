"""Voxel reduction: points that share a voxel become their mean.

Open3D's tensor `voxel_down_sample` returns the voxels in an order that changes from run to run;
this one is ordered by position, sums in the order of the input and is therefore reproducible.
"""

import numpy as np
from jaxtyping import Float32, Int64


def voxel_means(
    points: Float32[np.ndarray, "n 3"],
    attributes: Float32[np.ndarray, "n a"],
    voxel_size_m: float,
) -> tuple[Float32[np.ndarray, "m 3"], Float32[np.ndarray, "m a"], Int64[np.ndarray, " m"]]:
    """Average points and their attributes over the cells of a regular grid.

    Cells are centred on multiples of their size: the same surface falls into the same cells
    whatever else is in view, and a table at height 0 lies in a layer's middle, not between two.

    Args:
        points: (N, 3) float32 world coordinates, metres.
        attributes: (N, A) float32, averaged along with the points.
        voxel_size_m: Edge of a cell, metres.

    Returns:
        (M, 3) float32 mean points, (M, A) float32 mean attributes and (M,) int64 counts, one row
        for each occupied cell, cells in lexicographic order.
    """
    if len(points) == 0:
        return points, attributes, np.zeros(0, np.int64)
    cells = np.floor(points * np.float32(1.0 / voxel_size_m) + np.float32(0.5)).astype(np.int64)
    cells -= cells.min(axis=0)
    size = cells.max(axis=0) + 1
    keys = (cells[:, 0] * size[1] + cells[:, 1]) * size[2] + cells[:, 2]
    _, rows, counts = np.unique(keys, return_inverse=True, return_counts=True)
    columns = [*points.T, *attributes.T]
    means = np.stack([np.bincount(rows, weights=column) / counts for column in columns], axis=1)
    means = means.astype(np.float32)
    return means[:, :3].copy(), means[:, 3:].copy(), counts
