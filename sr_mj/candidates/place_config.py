"""Settings of the place sampler, each with its reason."""

from dataclasses import dataclass, field

import numpy as np

from perception.segments import SegmentConfig
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.errors import ConfigError

_POSITIVE = (
    "cell_m", "column_m", "grid_m", "min_side_m", "spread_m", "max_fall_m", "contact_m",
)  # fmt: skip
_NOT_NEGATIVE = ("release_gap_m", "clearance_m", "edge_m", "max_lift_m", "gripper_clearance_m")
_COUNTS = ("num_yaws", "num_core", "num_inside", "num_beside", "num_table", "max_candidates")


@dataclass(frozen=True, kw_only=True)
class PlaceConfig:
    """Settings of `SurfacePlacer`.

    Attributes:
        grasping: Settings shared with the grasp sampler: the gripper's boxes, how wide it opens,
            and how the cloud is thinned.
        segments: How the cloud is divided into things to place by.
        workspace_min: Least x, y of what is put on the table, metres; None for the cloud's bounds.
        workspace_max: Largest x, y of the same.
        cell_m: Edge of a cell of the height map.
        column_m: Spacing of the columns that stand for the held object and the gripper.
        num_yaws: Turns about the vertical that are tried, evenly spread over a full turn from the
            heading of the grasp.
        grid_m: Spacing of the places tried on the table.
        num_core: Places tried on or in a segment, about.
        min_side_m: Smaller side of the smallest segment that something may be put on.
        ring_m: Least and largest distance of the held object's centre from a segment's edge for
            places beside it. The protocol's ring is 0.05 to 0.15 m; 8 mm less at both ends allow
            for the cloud's errors.
        clearance_m: Least distance of an object put on the table from everything else.
        edge_m: Distance that its outline keeps from the edge of the workspace.
        gripper_clearance_m: Least height of the gripper over what is below it.
        release_gap_m: Height over its support at which an object is let go.
        max_lift_m: How much higher than that it may be let go over the table, for the gripper to
            stay clear of neighbours.
        max_fall_m: The same on and in things: the gripper may have to stay above a rim.
        contact_m: The support of an object is what lies this little below the highest point under
            its footprint; the noise of a fused cloud is 1 to 2 mm.
        min_balance_m: How far the centre must lie inside what supports it.
        min_basin_m: Depth under a rim on all sides from which on nothing can roll out, whatever
            supports it.
        spread_m: Chosen places of one relation to one segment are at least this far apart.
        num_inside: Most candidates on or in a segment.
        num_beside: Most candidates beside a segment.
        num_table: Most candidates on the table wherever it is free.
        max_candidates: Most candidates returned.

    Raises:
        ConfigError: If a value is out of its range.
    """

    grasping: AntipodalConfig = field(default_factory=AntipodalConfig)
    segments: SegmentConfig = field(
        default_factory=lambda: SegmentConfig(
            voxel_size_m=0.004, radius_m=0.0065, min_points=20, crease_deg=15.0
        )
    )
    workspace_min: tuple[float, float] | None = None
    workspace_max: tuple[float, float] | None = None
    cell_m: float = 0.004
    column_m: float = 0.006
    num_yaws: int = 8
    grid_m: float = 0.015
    num_core: int = 12
    min_side_m: float = 0.025
    ring_m: tuple[float, float] = (0.058, 0.142)
    clearance_m: float = 0.008
    edge_m: float = 0.005
    gripper_clearance_m: float = 0.006
    release_gap_m: float = 0.003
    max_lift_m: float = 0.01
    max_fall_m: float = 0.12
    contact_m: float = 0.005
    min_balance_m: float = 0.003
    min_basin_m: float = 0.012
    spread_m: float = 0.025
    num_inside: int = 12
    num_beside: int = 18
    num_table: int = 16
    max_candidates: int = 200

    def __post_init__(self) -> None:
        """Check the ranges."""
        for names, is_good, expected in (
            (_POSITIVE, lambda value: value > 0, "more than 0"),
            (_NOT_NEGATIVE, lambda value: value >= 0, "0 or more"),
            (_COUNTS, lambda value: value >= 1, "1 or more"),
        ):
            for name in names:
                value = getattr(self, name)
                if not is_good(value):
                    raise ConfigError(f"PlaceConfig: {name} is {value}, expected {expected}.")
        if not 0 <= self.ring_m[0] < self.ring_m[1]:
            raise ConfigError(
                f"PlaceConfig: ring_m is {self.ring_m}, expected a least and a larger distance."
            )

    @property
    def yaws(self) -> np.ndarray:
        """(Y,) turns about the vertical, radians."""
        return np.arange(self.num_yaws) * (2 * np.pi / self.num_yaws)
