"""Segments of a cloud, for candidates that need things instead of points.

Points are neighbours if they are near; a segment is what neighbours connect. With
`is_split_at_creases` nothing connects through a concave crease: the surfaces of one thing mostly
bulge, and where two things touch they meet in a crease (after LCCP, Stein et al., CVPR 2014).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from perception.errors import InvalidConfigError
from perception.voxels import average_rows, voxel_rows

# A voxel belongs to a crease if this share of its pairs do. One pair is not enough, as normals are
# noisy; and the voxels in the middle of a crease mix both sides and would bridge it.
_CREASED_SHARE = 0.2


@dataclass(frozen=True, kw_only=True)
class SegmentConfig:
    """Settings of the segmentation.

    Attributes:
        voxel_size_m: Points are averaged over voxels of this size first.
        radius_m: Farthest neighbours that connect.
        min_points: Voxels of the smallest segment.
        is_split_at_creases: Whether concave creases separate.
        crease_deg: Angle by which two normals must lean towards each other to make a crease; less
            is noise.
    """

    voxel_size_m: float = 0.005
    radius_m: float = 0.009
    min_points: int = 15
    is_split_at_creases: bool = False
    crease_deg: float = 10.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("voxel_size_m", "radius_m", "min_points", "crease_deg"):
            if not getattr(self, name) > 0:
                raise InvalidConfigError(f"{name} is {getattr(self, name)}, expected more than 0.")


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """A connected part of a cloud.

    Attributes:
        indices: (M,) int64 rows of the cloud, in rising order.
        low: (3,) float32 lower corner of its bounding box, world, metres.
        high: (3,) float32 upper corner.
    """

    indices: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def center(self) -> np.ndarray:
        """(3,) float32: middle of the bounding box, metres."""
        return (self.low + self.high) / 2


def find_segments(
    points: Float32[np.ndarray, "n 3"],
    normals: Float32[np.ndarray, "n 3"],
    config: SegmentConfig,
) -> tuple[Segment, ...]:
    """Divide a cloud, without its table, into connected parts.

    Args:
        points: (N, 3) float32 world coordinates, metres.
        normals: (N, 3) float32 unit normals, outwards.
        config: Settings.

    Returns:
        The segments, the one with the most voxels first. No point is in two of them; points of
        parts below `min_points` are in none.
    """
    if len(points) == 0:
        return ()
    rows, counts = voxel_rows(points, config.voxel_size_m)
    centers, directions = average_rows(points, rows, counts), average_rows(normals, rows, counts)
    pairs = KDTree(centers).query_pairs(config.radius_m, output_type="ndarray")
    is_core = np.ones(len(centers), bool)
    if config.is_split_at_creases:
        is_core = ~_in_crease(centers, directions, pairs, config.crease_deg)
    labels = _connect(centers, pairs, is_core)
    num_voxels = np.bincount(labels)
    kept = np.flatnonzero(num_voxels >= config.min_points)
    kept = kept[np.argsort(-num_voxels[kept], kind="stable")]
    return tuple(_segment(points, np.flatnonzero(labels[rows] == label)) for label in kept)


def _connect(centers: np.ndarray, pairs: np.ndarray, is_core: np.ndarray) -> np.ndarray:
    """Return (M,) labels: core voxels by connection, the others as the nearest core voxel."""
    size = len(centers)
    first, second = pairs[is_core[pairs].all(axis=1)].T
    graph = coo_array((np.ones(len(first), bool), (first, second)), shape=(size, size))
    _, labels = connected_components(graph, directed=False)
    if not is_core.all() and is_core.any():
        _, nearest = KDTree(centers[is_core]).query(centers[~is_core])
        labels[~is_core] = labels[is_core][nearest]
    return labels


def _in_crease(
    centers: np.ndarray, directions: np.ndarray, pairs: np.ndarray, crease_deg: float
) -> np.ndarray:
    """Return (M,) bool: the normals of many pairs of a voxel lean towards each other."""
    first, second = pairs.T
    step = centers[second] - centers[first]
    step /= np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9)
    lean = ((directions[first] - directions[second]) * step).sum(axis=1)
    # Two unit normals at an angle a that open symmetrically differ by 2 sin(a / 2) along the step.
    is_creased = lean > 2.0 * np.sin(np.radians(crease_deg) / 2.0)
    num_pairs = np.bincount(pairs.ravel(), minlength=len(centers))
    num_creased = np.bincount(pairs[is_creased].ravel(), minlength=len(centers))
    return num_creased > _CREASED_SHARE * np.maximum(num_pairs, 1)


def _segment(points: np.ndarray, indices: np.ndarray) -> Segment:
    part = points[indices]
    return Segment(indices=indices, low=part.min(axis=0), high=part.max(axis=0))
