"""Segments of a cloud by its shape alone: what stands for the detected objects of the originals."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

NEIGHBOUR_M = 0.012
"""Points this near are joined: of voxels of 8 mm, those that share a face or an edge (11.3 mm)."""
# A valley this deep parts two tops. Depth is off by 1 to 2 mm after fusion.
_MIN_VALLEY_M = 0.003
MIN_POINTS = 10
"""Segments with fewer points, about 6 square centimetres, are not taken for objects."""


def segment(points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Divide a cloud without the table into segments, each a hill with a top of its own.

    Points are gone through from the highest down. Hills that meet are one if the lower top rises
    less than 3 mm above the pass between them, or is still smaller than an object. No learning and
    no ground truth; objects whose surfaces touch without a valley between them stay together.

    Args:
        points: (N, 3) world coordinates, metres; N may be 0.

    Returns:
        (N,) labels 0..S-1.
    """
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    heights = points[:, 2].astype(np.float64)
    pairs = KDTree(points).query_pairs(NEIGHBOUR_M, output_type="ndarray")
    passes = heights[pairs].min(axis=1)
    parents = list(range(len(points)))
    tops, sizes = heights.tolist(), [1] * len(points)

    def root(index: int) -> int:
        while parents[index] != index:
            parents[index] = parents[parents[index]]
            index = parents[index]
        return index

    order = np.argsort(-passes, kind="stable")
    for (here, there), height in zip(pairs[order].tolist(), passes[order].tolist(), strict=True):
        high, low = root(here), root(there)
        if tops[high] < tops[low]:
            high, low = low, high
        is_hill = sizes[low] >= MIN_POINTS and tops[low] - height >= _MIN_VALLEY_M
        if high != low and not (is_hill and sizes[high] >= MIN_POINTS):
            parents[low] = high
            sizes[high] += sizes[low]
    return np.unique([root(i) for i in range(len(points))], return_inverse=True)[1].ravel()


def means(values: Float[np.ndarray, " N"], labels: Int[np.ndarray, " N"]) -> np.ndarray:
    """Average a value over each segment.

    Args:
        values: (N,) one value a point.
        labels: (N,) labels 0..S-1, as of `segment`.

    Returns:
        (S,) float64 means; those of segments too small for an object are minus infinity, unless
        all are too small.
    """
    sizes = np.bincount(labels)
    result = np.bincount(labels, values.astype(np.float64)) / sizes
    is_object = sizes >= MIN_POINTS
    return np.where(is_object | ~is_object.any(), result, -np.inf)


def owners(
    points: Float[np.ndarray, "N 3"],
    labels: Int[np.ndarray, " N"],
    positions: Float[np.ndarray, "K 3"],
) -> Int[np.ndarray, " K"]:
    """Tell which segment each grasp is on: that of the point next to the middle of the pads.

    Args:
        points: (N, 3) the cloud, N at least 1, metres.
        labels: (N,) its segments.
        positions: (K, 3) tool centre points, metres.

    Returns:
        (K,) labels.
    """
    return labels[KDTree(points).query(positions)[1]]


def ranks(values: Float[np.ndarray, " S"]) -> Int[np.ndarray, " S"]:
    """Number values from the smallest, 0, to the largest; equal values in their order.

    Args:
        values: (S,) values.

    Returns:
        (S,) ranks.
    """
    result = np.empty(len(values), dtype=np.int64)
    result[np.argsort(values, kind="stable")] = np.arange(len(values))
    return result
