"""The segments of a scene as objects: what each looks like, where it is, how large it is."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from policy.arrays import check_range, checked_array
from policy.segments import MIN_POINTS, segment


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneObjects:
    """What stands for the objects of a scene: its segments, found by shape alone.

    Arrays are copied, checked and made read-only.

    Attributes:
        features: (S, C) float32 mean of the features of each segment's points. S may be 0.
        similarity: (S,) float32 mean of their similarities to the instruction.
        positions: (S, 3) float32 middle of each segment in the world, metres.
        sizes: (S, 3) float32 length and width seen from above, along the segment's own axes, and
            height, metres. Turning the scene about the vertical does not change them.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    features: np.ndarray
    similarity: np.ndarray
    positions: np.ndarray
    sizes: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        shapes: dict[str, tuple[int | str, ...]] = {
            "features": ("S", "C"),
            "similarity": ("S",),
            "positions": ("S", 3),
            "sizes": ("S", 3),
        }
        sizes: dict[str, int] = {}
        for name, shape in shapes.items():
            array = checked_array(f"objects.{name}", getattr(self, name), shape, sizes=sizes)
            object.__setattr__(self, name, array)
        check_range("objects.sizes", self.sizes, 0.0)

    def __len__(self) -> int:
        """Return the number S of segments."""
        return len(self.features)

    def moved(self, T: Float[np.ndarray, "4 4"]) -> "SceneObjects":
        """Move the segments about the vertical.

        Args:
            T: Transform of the world that leaves the vertical as it is.

        Returns:
            The segments as they would have been seen.
        """
        positions = self.positions @ T[:3, :3].T + T[:3, 3]
        return replace(self, positions=positions)

    def normalised(
        self, center: Float[np.ndarray, "3"], half: Float[np.ndarray, "3"]
    ) -> "SceneObjects":
        """Express positions and sizes in units in which the workspace spans [-1, 1].

        Args:
            center: Middle of the workspace, metres.
            half: Half of its extent along each axis, metres.

        Returns:
            The segments in those units.
        """
        positions = (self.positions - center) / half
        # Seen from above, a size has a direction of its own, and both axes must count alike.
        ground = half[:2].mean()
        return replace(
            self, positions=positions, sizes=self.sizes / np.array([ground, ground, half[2]])
        )


def object_labels(points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Divide a cloud into objects.

    Args:
        points: (N, 3) the whole cloud, metres; a thinned one falls apart. N may be 0.

    Returns:
        (N,) labels 0..S-1; -1 for points of segments too small for an object, unless all are.
    """
    labels = segment(points)
    is_object = np.bincount(labels) >= MIN_POINTS
    if not is_object.any():
        return labels
    return np.where(is_object, np.cumsum(is_object) - 1, -1)[labels]


def pool_objects(
    points: Float[np.ndarray, "N 3"],
    features: Float[np.ndarray, "N C"],
    similarity: Float[np.ndarray, " N"],
    labels: Int[np.ndarray, " N"],
) -> SceneObjects:
    """Describe the objects of a cloud.

    Args:
        points: (N, 3) the cloud, metres.
        features: (N, C) its features.
        similarity: (N,) its similarities.
        labels: (N,) from `object_labels`.

    Returns:
        One row an object. Features are plain means: a factor on a channel is one on its mean.
    """
    num_objects = int(labels.max(initial=-1)) + 1
    rows = [np.flatnonzero(labels == i) for i in range(num_objects)]
    boxes = [_box(points[row].astype(np.float64)) for row in rows]
    return SceneObjects(
        features=np.reshape([features[row].mean(axis=0) for row in rows], (-1, features.shape[1])),
        similarity=label_means(similarity, labels),
        positions=np.reshape([position for position, _ in boxes], (-1, 3)),
        sizes=np.reshape([size for _, size in boxes], (-1, 3)),
    )


def find_objects(
    points: Float[np.ndarray, "N 3"],
    features: Float[np.ndarray, "N C"],
    similarity: Float[np.ndarray, " N"],
) -> SceneObjects:
    """Find and describe the objects of a cloud.

    Args:
        points: (N, 3) the whole cloud, metres.
        features: (N, C) its features.
        similarity: (N,) its similarities.

    Returns:
        One row an object.
    """
    return pool_objects(points, features, similarity, object_labels(points))


def label_means(
    values: Float[np.ndarray, " N"], labels: Int[np.ndarray, " N"]
) -> Float[np.ndarray, " S"]:
    """Average a value over each object.

    Args:
        values: (N,) one value a point.
        labels: (N,) from `object_labels`.

    Returns:
        (S,) means.
    """
    inside = labels >= 0
    return np.bincount(labels[inside], values[inside].astype(np.float64)) / np.bincount(
        labels[inside]
    )


def _box(points: Float[np.ndarray, "M 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Middle of an upright box around points, and its length, width and height."""
    # The axes that the points spread along most and least, seen from above.
    axes = np.linalg.eigh(np.cov(points[:, :2].T, bias=True))[1]
    along = np.column_stack([points[:, :2] @ axes[:, ::-1], points[:, 2]])
    low, high = along.min(axis=0), along.max(axis=0)
    middle = (low + high) / 2
    return np.append(axes[:, ::-1] @ middle[:2], middle[2]), high - low
