"""A cloud as heights over the table, for questions about straight descents from above."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, grey_closing

_MARGIN_M = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightMap:
    """The highest surface over every cell of the table.

    Whatever comes down vertically meets this surface and no other, so that the sweep of a straight
    descent needs no more than the heights under the lower side of what moves.

    Attributes:
        heights_m: (X, Y) float32 heights over the table; 0 where nothing stands.
        distance_m: (X, Y) float32 distances to the nearest cell that something stands on.
        origin: (2,) world x, y of the first cell's lower corner, metres.
        cell_m: Edge of a cell.
    """

    heights_m: np.ndarray
    distance_m: np.ndarray
    origin: np.ndarray
    cell_m: float

    def cells(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the cells of points (..., 2); what lies beyond the map falls into its border."""
        index = np.floor((xy - self.origin) * (1 / self.cell_m)).astype(np.int64)
        index = index.clip(0, np.array(self.heights_m.shape) - 1)
        return index[..., 0], index[..., 1]

    def height_m(self, xy: np.ndarray) -> np.ndarray:
        """Return the heights (...) under points (..., 2), metres."""
        return self.heights_m[self.cells(xy)]

    def clearance_m(self, xy: np.ndarray) -> np.ndarray:
        """Return the distances (...) of points (..., 2) from whatever stands on the table."""
        return self.distance_m[self.cells(xy)]


def height_map(points: np.ndarray, bounds: np.ndarray, cell_m: float) -> HeightMap:
    """Find the highest point of every column.

    Args:
        points: (N, 3) float32 points of what stands on the table, metres; N may be 0.
        bounds: (2, 2) lower and upper x, y of the workspace, metres.
        cell_m: Edge of a column.

    Returns:
        The map, a margin wider than the workspace. Holes of a cell or two, where a camera missed a
        spot of a surface, are closed.
    """
    origin = bounds[0] - _MARGIN_M
    shape = np.ceil((bounds[1] + _MARGIN_M - origin) / cell_m).astype(np.int64)
    cells = np.floor((points[:, :2] - origin) / cell_m).astype(np.int64)
    known = ((cells >= 0) & (cells < shape)).all(axis=1)
    heights = np.zeros(shape, np.float32)
    np.maximum.at(heights, tuple(cells[known].T), points[known, 2])
    heights = grey_closing(heights, size=(3, 3))
    distance = np.full(shape, np.inf, np.float32)
    if heights.any():
        distance = np.asarray(distance_transform_edt(heights == 0, sampling=cell_m), np.float32)
    return HeightMap(heights_m=heights, distance_m=distance, origin=origin, cell_m=cell_m)
