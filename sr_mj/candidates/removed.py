"""What was taken away between two looks: the surest sign of what the gripper holds."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from sr_mj.candidates.place_parts import Parts
from sr_mj.candidates.surface import voxel_keys

# Farther than noise and a thinned cloud's spacing, nearer than the top of a pen on the table.
_GONE_M = 0.006
_LINK_M = 0.008
_OVERLAP, _LEAST_PART = 0.7, 20
_PUSHED_M, _PUSHED_SHARE, _GONE_SHARE = 0.03, 0.3, 0.5
_LEAST_SHARE, _LEAST_POINTS = 0.4, 5
_CELL_M = 0.006


def removed_points(
    parts: Parts, after: np.ndarray, gripped: np.ndarray, likely: np.ndarray
) -> np.ndarray | None:
    """Find the points of what a grasp took away.

    Args:
        parts: The surface before the grasp, N points, and its parts.
        after: (M, 3) surface points of the look after it, without what is held, metres.
        gripped: (N,) which points lay between the fingers.
        likely: (N,) which points belong, by their looks, to what was gripped.

    Returns:
        (N,) mask of the points that are gone and connected with those between the fingers; None if
        most of these are still there, so that the second look says nothing.
    """
    before = parts.surface.points
    gone = _is_far_from(after, before)
    sure = gone & gripped
    if sure.sum() < max(_LEAST_POINTS, _LEAST_SHARE * gripped.sum()):
        return None
    rows = np.flatnonzero(gone)
    labels = _connected(before[rows])
    mine = labels == np.bincount(labels[sure[rows]]).argmax()
    mine |= _over_or_under(before[rows, :2], labels, mine)
    mask = np.zeros(len(before), bool)
    mask[rows[mine]] = True
    return mask & ~_was_pushed(parts, after, mask, likely)


def _is_far_from(others: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Mask of the points (N, 3) with no other (M, 3) where they are."""
    if not len(others):
        return np.ones(len(points), bool)
    return ~np.isfinite(KDTree(others).query(points, distance_upper_bound=_GONE_M)[0])


def _was_pushed(
    parts: Parts, after: np.ndarray, mine: np.ndarray, likely: np.ndarray
) -> np.ndarray:
    """Mask of the points of parts that moved aside.

    Half of such a part is where it was before, or much has appeared beside it.
    """
    before = parts.surface.points
    appeared = after[_is_far_from(before, after)]
    pushed = np.zeros(len(before), bool)
    for label in np.unique(parts.labels[mine & ~likely]):
        part = parts.labels == label
        if part.sum() < _LEAST_PART or (part & likely).any():
            continue
        num_beside = 0
        if len(appeared):
            found = KDTree(before[part]).query(appeared, distance_upper_bound=_PUSHED_M)[0]
            num_beside = np.isfinite(found).sum()
        if num_beside > _PUSHED_SHARE * part.sum() or mine[part].mean() < _GONE_SHARE:
            pushed |= part
    return pushed


def _connected(points: np.ndarray) -> np.ndarray:
    """Number the connected components of points (N, 3)."""
    pairs = KDTree(points).query_pairs(_LINK_M, output_type="ndarray")
    ones = np.ones(len(pairs), bool)
    graph = coo_array((ones, tuple(pairs.T)), shape=(len(points), len(points)))
    return connected_components(graph, directed=False)[1]


def _over_or_under(xy: np.ndarray, labels: np.ndarray, mine: np.ndarray) -> np.ndarray:
    """Mask of the components that lie mostly over or under one, or it over or under them.

    No camera sees into the neck of a toy; what is gone above and below it was one thing. What a
    grasp pushes aside lies beside, as a rule.
    """
    size = np.bincount(labels)
    near = np.isfinite(KDTree(xy[mine]).query(xy, distance_upper_bound=_LINK_M)[0])
    is_alike = np.bincount(labels, near, minlength=len(size)) > _OVERLAP * size
    for label in np.flatnonzero(~is_alike & (size >= _LEAST_PART)):
        tree = KDTree(xy[labels == label])
        near = np.isfinite(tree.query(xy[mine], distance_upper_bound=_LINK_M)[0])
        is_alike[label] = near.mean() > _OVERLAP
    return is_alike[labels]


def revealed_heights(own: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Look at what lies where an object was.

    Args:
        own: (N, 3) the object's points, metres.
        after: (M, 3) points of the look after it was taken away, the table's among them.

    Returns:
        (C,) height of the highest point in every seen cell below the object, metres.
    """
    wanted = np.unique(voxel_keys(own[:, :2], _CELL_M))
    keys = voxel_keys(after[:, :2], _CELL_M)
    below = np.isin(keys, wanted)
    if not below.any():
        return np.zeros(0)
    cells, heights = keys[below], after[below, 2]
    order = np.argsort(cells, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(cells[order]) != 0])
    return np.maximum.reduceat(heights[order], starts)
