"""Segments of a scene as arrays, for a policy that looks at objects instead of points."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from policy.arrays import check_range, checked_array


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

    def moved(self, T: Float[np.ndarray, "4 4"], gain: Float[np.ndarray, " C"]) -> "SceneObjects":
        """Move the segments about the vertical, and scale the channels of their features.

        Args:
            T: Transform of the world that leaves the vertical as it is.
            gain: Factor of each channel.

        Returns:
            The segments as they would have been seen.
        """
        positions = self.positions @ T[:3, :3].T + T[:3, 3]
        return replace(self, positions=positions, features=self.features * gain)

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
