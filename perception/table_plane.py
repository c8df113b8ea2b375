"""The plane of the table: RANSAC among the points where the workspace says that it must be."""

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from jaxtyping import Bool, Float

from perception.errors import InvalidConfigError

_ITERATIONS = 200
_MIN_POINTS = 50
_SEED = 0


@dataclass(frozen=True, kw_only=True)
class TablePrior:
    """What is known of the table before looking.

    Attributes:
        height_m: Height of its surface in the world.
        height_tolerance_m: How far off that height may be; points further away are no candidates.
        max_tilt_deg: How far its normal may lean from the world's vertical.
        thickness_m: Points up to this far above the plane belong to the table: its noise.
    """

    height_m: float = 0.0
    height_tolerance_m: float = 0.02
    max_tilt_deg: float = 3.0
    thickness_m: float = 0.003

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("height_tolerance_m", "max_tilt_deg", "thickness_m"):
            if not getattr(self, name) > 0:
                raise InvalidConfigError(f"{name} is {getattr(self, name)}, expected more than 0.")


@dataclass(frozen=True, kw_only=True)
class Plane:
    """A plane whose normal points upwards: normal . x = offset_m.

    Attributes:
        normal: Unit normal in the world.
        offset_m: Distance from the origin along the normal.
    """

    normal: tuple[float, float, float]
    offset_m: float

    def heights(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Return how far points lie above the plane.

        Args:
            points: (N, 3) world coordinates, metres.

        Returns:
            (N,) metres, negative below.
        """
        return points @ np.asarray(self.normal, points.dtype) - points.dtype.type(self.offset_m)


def find_table(points: Float[np.ndarray, "n 3"], prior: TablePrior) -> Plane | None:
    """Find the table's plane; the same points give the same plane.

    A box or a book seen from above is a plane too, often a larger one than what is left of the
    table: only points near the expected height are asked, and only a level plane is believed.

    Args:
        points: (N, 3) world coordinates, metres.
        prior: Where the table must be.

    Returns:
        The plane, or None if there is none where it must be.
    """
    near = points[np.abs(points[:, 2] - prior.height_m) <= prior.height_tolerance_m]
    if len(near) < _MIN_POINTS:
        return None
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(near.astype(np.float64)))
    o3d.utility.random.seed(_SEED)
    # With probability 1 it never stops early: how early would depend on the number of threads.
    model, _ = cloud.segment_plane(prior.thickness_m, 3, _ITERATIONS, probability=1.0)
    model = np.asarray(model) * (1.0 if model[2] >= 0 else -1.0)
    if model[2] < np.cos(np.radians(prior.max_tilt_deg)):
        return None
    x, y, z = (float(value) for value in model[:3])
    return Plane(normal=(x, y, z), offset_m=float(-model[3]))


def above_table(points: Float[np.ndarray, "n 3"], prior: TablePrior) -> Bool[np.ndarray, " n"]:
    """Tell the points that stand above the table from the table's own and those below.

    Args:
        points: (N, 3) world coordinates, metres.
        prior: Where the table must be.

    Returns:
        (N,) bool; all True if no table was found.
    """
    plane = find_table(points, prior)
    if plane is None:
        return np.ones(len(points), bool)
    return plane.heights(points) > prior.thickness_m
