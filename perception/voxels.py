"""Voxel reduction: points that share a voxel become their mean, features by their confidence.

Open3D's tensor `voxel_down_sample` returns the voxels in an order that changes from run to run;
this one is ordered by position, sums in the order of the input and is therefore reproducible.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float32, Int64
from scipy.sparse import csr_array

from perception.cloud import FeatureCloud
from perception.errors import InvalidConfigError

_TINY = 1e-6
_MOST_TABLED_CELLS = 1 << 25  # 160 MB of tables


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
    rows, counts = voxel_rows(points, voxel_size_m)
    return average_rows(points, rows, counts), average_rows(attributes, rows, counts), counts


def voxel_rows(
    points: Float32[np.ndarray, "n 3"], voxel_size_m: float
) -> tuple[Int64[np.ndarray, " n"], Int64[np.ndarray, " m"]]:
    """Number the occupied cells of a regular grid.

    Args:
        points: (N, 3) float32 world coordinates, metres.
        voxel_size_m: Edge of a cell, metres.

    Returns:
        (N,) int64 number of each point's cell, cells in lexicographic order, and (M,) int64 points
        in each cell.
    """
    if len(points) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    keys, num_cells = _cell_keys(points, voxel_size_m)
    if num_cells > _MOST_TABLED_CELLS:
        _, rows, counts = np.unique(keys, return_inverse=True, return_counts=True)
        return rows, counts
    # The same by a table over the whole grid: several times faster than sorting.
    is_occupied = np.zeros(num_cells, bool)
    is_occupied[keys] = True
    occupied = np.flatnonzero(is_occupied)
    numbers = np.empty(num_cells, np.int64)
    numbers[occupied] = np.arange(len(occupied))
    rows = numbers[keys]
    return rows, np.bincount(rows)


def _cell_keys(points: np.ndarray, voxel_size_m: float) -> tuple[np.ndarray, int]:
    """Return (N,) int64 lexicographic positions of the points' cells, and the size of the grid."""
    keys, num_cells = np.zeros(len(points), np.int64), 1
    # Axis by axis: a third of the memory, and fast for points that are stored by axis.
    for axis in points.T:
        cells = axis * np.float32(1.0 / voxel_size_m)
        cells += np.float32(0.5)
        cells = np.floor(cells, out=cells).astype(np.int64)
        low = cells.min()
        size = int(cells.max() - low) + 1
        keys *= size
        keys += cells
        keys -= low
        num_cells *= size
    return keys, num_cells


def average_rows(
    values: Float32[np.ndarray, "n a"],
    rows: Int64[np.ndarray, " n"],
    counts: Int64[np.ndarray, " m"],
) -> Float32[np.ndarray, "m a"]:
    """Average the values of the points in each cell.

    Args:
        values: (N, A) float32.
        rows: (N,) cell of each point.
        counts: (M,) points in each cell.

    Returns:
        (M, A) float32 means.
    """
    means = np.empty((len(counts), values.shape[1]), np.float32)
    for column, target in zip(values.T, means.T, strict=True):
        target[:] = np.bincount(rows, weights=column, minlength=len(counts)) / counts
    return means


def reduce_cloud(cloud: FeatureCloud, voxel_size_m: float) -> FeatureCloud:
    """Thin out a cloud with features: one point a voxel, what is sure counts more.

    Points, colours, normals, features and similarity are averaged by confidence. A voxel is as sure
    as its surest point.

    Args:
        cloud: The cloud.
        voxel_size_m: Edge of a voxel, metres.

    Returns:
        The smaller cloud, voxels in lexicographic order. Where normals or features cancel out, that
        of the surest point stays.

    Raises:
        InvalidConfigError: If the voxel size is not positive.
    """
    if not voxel_size_m > 0:
        raise InvalidConfigError(f"voxel_size_m is {voxel_size_m}, expected more than 0 m.")
    if len(cloud) == 0:
        return cloud
    rows, counts = voxel_rows(cloud.points, voxel_size_m)
    weights = cloud.confidence.astype(np.float64)
    mixing = csr_array((weights, (rows, np.arange(len(rows)))), shape=(len(counts), len(rows)))
    mixing = mixing.multiply(1.0 / mixing.sum(axis=1)[:, None]).tocsr()
    # Sorted by cell, then by falling confidence: the first of a cell is its surest point.
    order = np.lexsort((-weights, rows))
    surest = order[np.concatenate([[0], np.cumsum(counts)[:-1]])]
    mean = {
        name: (mixing @ getattr(cloud, name)).astype(np.float32)
        for name in ("points", "colors", "similarity")
    }
    unit = {
        name: _unit_rows(mixing @ getattr(cloud, name), getattr(cloud, name)[surest])
        for name in ("normals", "features")
    }
    return replace(cloud, **mean, **unit, confidence=cloud.confidence[surest])


def _unit_rows(sums: np.ndarray, instead: np.ndarray) -> np.ndarray:
    """Scale rows to unit length; return those of `instead` where there is no direction."""
    norms = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(norms > _TINY, sums / np.maximum(norms, _TINY), instead).astype(np.float32)
