"""What the cameras saw, as obstacles: a distance field, and the points it was made from."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.surface import thin, unseen_walls

_MIN_HEIGHT_M = AntipodalConfig.object_min_height_m
_POINT_STEP_M = 0.005
_VOXEL_M = 0.01
# The field reaches this far beyond the points; farther away everything counts as equally far.
_PAD_M = 0.08


@dataclass(frozen=True, kw_only=True, eq=False)
class Obstacles:
    """Points over the table, with a field of the distance to the nearest one.

    Attributes:
        points: (N, 3) float32 thinned points, with walls below edges where no camera looked.
        distance_m: (X, Y, Z) float32 distances at the field's nodes.
        origin: (3,) position of the first node.
    """

    points: np.ndarray
    distance_m: np.ndarray
    origin: np.ndarray

    def distances(self, positions: np.ndarray) -> np.ndarray:
        """Look up distances to the nearest point; they are off by 5 mm at most.

        Args:
            positions: (..., 3) world positions, metres.

        Returns:
            (...) distances, metres; beyond the field that at its border.
        """
        nodes = (positions.reshape(-1, 3) - self.origin) / _VOXEL_M
        found = map_coordinates(self.distance_m, nodes.T, order=1, mode="nearest", prefilter=False)
        return found.reshape(positions.shape[:-1])


def find_obstacles(points: np.ndarray | None) -> Obstacles | None:
    """Make obstacles of a cloud.

    Args:
        points: (N, 3) world positions with the table at z = 0, whose own points are ignored; or
            None.

    Returns:
        The obstacles; None if there is nothing over the table.
    """
    if points is None:
        return None
    above = np.asarray(points, np.float32).reshape(-1, 3)
    above = above[above[:, 2] > _MIN_HEIGHT_M]
    if not len(above):
        return None
    surface = thin(above, _POINT_STEP_M)
    surface = np.concatenate([surface, unseen_walls(surface, _POINT_STEP_M)])
    origin = surface.min(axis=0) - _PAD_M
    nodes = np.round((surface - origin) / _VOXEL_M).astype(int)
    shape = nodes.max(axis=0) + int(_PAD_M / _VOXEL_M) + 1
    is_empty = np.ones(shape, bool)
    is_empty[tuple(nodes.T)] = False
    distance = distance_transform_edt(is_empty, sampling=_VOXEL_M)
    return Obstacles(points=surface, distance_m=np.asarray(distance, np.float32), origin=origin)
