"""The boxes above the table in which tasks take place."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Workspace:
    """An axis-aligned box above the table, metres in world coordinates.

    Attributes:
        lower: Smallest x, y, z.
        upper: Largest x, y, z.
    """

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    @property
    def center(self) -> np.ndarray:
        """Return the centre (3,)."""
        return (np.array(self.lower) + np.array(self.upper)) / 2

    @property
    def diagonal_m(self) -> float:
        """Return the length of the box's diagonal in metres."""
        return float(np.linalg.norm(np.subtract(self.upper, self.lower)))

    def contains_xy(self, points: np.ndarray) -> np.ndarray:
        """Tell which points lie inside, seen from above.

        Args:
            points: (..., 2) or (..., 3), metres.

        Returns:
            (...) bool.
        """
        xy = np.asarray(points)[..., :2]
        return np.all((xy >= self.lower[:2]) & (xy <= self.upper[:2]), axis=-1)


GRASP_WORKSPACE = Workspace(lower=(0.276, -0.224, 0.0), upper=(0.724, 0.224, 0.4))
PICK_PLACE_WORKSPACE = Workspace(lower=(0.164, -0.336, 0.0), upper=(0.836, 0.336, 0.4))
# Its halves: where things are taken from, and where they are put.
PICK_ZONE = Workspace(lower=(0.164, -0.336, 0.0), upper=(0.836, 0.0, 0.4))
PLACE_ZONE = Workspace(lower=(0.164, 0.0, 0.0), upper=(0.836, 0.336, 0.4))
