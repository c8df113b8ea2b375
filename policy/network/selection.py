"""Which points of a cloud the network gets to see."""

import numpy as np
from jaxtyping import Float, Int

from policy.network.config import PointSelection

_COVERED = 3
"""How many times as many of the most similar points "covering" spreads its first half over."""


def select_points(
    points: Float[np.ndarray, "N 3"],
    similarity: Float[np.ndarray, " N"],
    *,
    max_points: int,
    method: PointSelection,
) -> Int[np.ndarray, " M"]:
    """Choose at most `max_points` points; the choice doesn't depend on the points' order.

    Args:
        points: Positions in metres.
        similarity: Similarity to the instruction.
        max_points: Largest number of points.
        method: "balanced": half the most similar points, which hold the target, and half spread
            evenly over the rest, which hold the surroundings. "covering": the first half spread
            evenly over three times as many of the most similar points, so that few points show
            all of what is looked for, its middle and its edge, and not only the side of it that
            fits best. "similar": the most similar only.

    Returns:
        Indices of the chosen points, all of them where there are few enough.
    """
    if len(points) <= max_points:
        return np.arange(len(points))
    # Ties are broken by position, so that shuffled points give the same choice.
    by_position = np.lexsort((*points.T, -similarity))
    num_similar = max_points if method == "similar" else max_points // 2
    similar, rest = by_position[:num_similar], by_position[num_similar:]
    if method == "covering" and num_similar:
        region = by_position[: _COVERED * num_similar]
        first = _farthest_points(points[region[1:]], points[region[:1]], num_similar - 1)
        similar = region[np.concatenate([[0], 1 + first])]
        rest = by_position[~np.isin(by_position, similar)]
    spread = _farthest_points(points[rest], points[similar], max_points - num_similar)
    return np.concatenate([similar, rest[spread]])


def _farthest_points(
    points: Float[np.ndarray, "N 3"], chosen: Float[np.ndarray, "M 3"], num_points: int
) -> Int[np.ndarray, " P"]:
    """Farthest-point sampling that continues from points chosen before."""
    columns = np.ascontiguousarray(points.T, dtype=np.float64)
    nearest = np.full(len(points), np.inf)
    for point in chosen:
        _lower_to(nearest, columns, point)
    indices = np.empty(num_points, dtype=np.int64)
    for i in range(num_points):
        indices[i] = nearest.argmax()
        _lower_to(nearest, columns, columns[:, indices[i]])
        # A duplicate of a chosen point is at distance 0 too, but may still be taken, once.
        nearest[indices[i]] = -1.0
    return indices


def _lower_to(
    nearest: Float[np.ndarray, " N"],
    columns: Float[np.ndarray, "3 N"],
    point: Float[np.ndarray, "3"],
) -> None:
    """Lower each squared distance in place to that from one more point."""
    dx, dy, dz = columns[0] - point[0], columns[1] - point[1], columns[2] - point[2]
    np.minimum(nearest, dx * dx + dy * dy + dz * dz, out=nearest)
