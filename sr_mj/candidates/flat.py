"""Flat things that lie on the table by themselves, and which of them still lack a candidate."""

import numpy as np
from scipy import ndimage

_CELL_M = 0.01
# Fewer cells than this are specks, or the edge of something else.
_MIN_CELLS = 4
_AROUND = np.ones((3, 3), bool)


def flat_without_candidate(
    points: np.ndarray, origins: np.ndarray, positions: np.ndarray, max_height_m: float
) -> np.ndarray:
    """Find the seeds on flat parts of the surface over which there is no candidate.

    A flat part is a connected area of the table with nothing on it higher than `max_height_m`.

    Args:
        points: (N, 3) surface points over the table, metres, N > 0.
        origins: (S, 3) positions of the seeds, which are some of the points.
        positions: (K, 3) positions of the candidates.
        max_height_m: Height over the table up to which something is flat.

    Returns:
        (S,) mask.
    """
    lowest = points[:, :2].min(axis=0) - 2 * _CELL_M

    def cells(rows: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(np.floor((rows[:, :2] - lowest) / _CELL_M).astype(np.int64).T)

    x, y = cells(points)
    top = np.zeros((x.max() + 3, y.max() + 3), np.float32)
    np.maximum.at(top, (x, y), points[:, 2])
    parts = np.zeros(top.shape, np.int32)
    ndimage.label((top > 0) & (top <= max_height_m), _AROUND, output=parts)
    is_open = np.bincount(parts.ravel()) >= _MIN_CELLS
    # What is between the fingers lies in the candidate's cell, or next to it.
    is_taken = np.zeros_like(top, bool)
    i, j = (a.clip(0, n - 1) for a, n in zip(cells(positions), top.shape, strict=True))
    is_taken[i, j] = True
    around = np.asarray(ndimage.binary_dilation(is_taken, _AROUND), bool)
    is_open[parts[around]] = False
    is_open[0] = False
    return is_open[parts[cells(origins)]]
