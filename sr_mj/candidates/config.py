"""Settings of the antipodal grasp sampler, each with its reason."""

from dataclasses import dataclass, field

from models.gripper_geometry import ROBOTIQ_2F85_CLASS, GripperGeometry
from sr_mj.errors import ConfigError

_POSITIVE = (
    "object_min_height_m", "voxel_m", "scan_voxel_m", "wall_step_m", "seed_spacing_m",
    "pregrasp_m", "wrist_length_m", "nms_distance_m", "nms_angle_deg", "cell_m", "flat_height_m",
)  # fmt: skip
_NOT_NEGATIVE = ("extra_opening_m", "min_tip_height_m")
_COUNTS = (
    "max_seeds", "num_azimuths", "num_rolls", "max_placements", "max_survivors", "max_candidates",
    "max_per_cell",
)  # fmt: skip
_LARGEST_TILT_DEG = 75.0
_LEAST_CLEARANCE_M = -0.005


def _check(owner: str, name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ConfigError(f"{owner}: {name} is {value}, expected {low:g} to {high:g}.")


@dataclass(frozen=True, kw_only=True)
class Relaxation:
    """Thresholds that replace those of `AntipodalConfig`, of the same names, in a later pass.

    Attributes:
        min_alignment: Least mean cosine of contact normals and closing direction.
        max_opposition: Largest cosine between the mean normals of both contacts.
        clearance_m: Free space demanded around the gripper, metres.
        min_tip_height_m: Least height of a fingertip over the table.
        min_prior: Least prior of a candidate.

    Raises:
        ConfigError: If a value is out of its range.
    """

    min_alignment: float
    max_opposition: float
    clearance_m: float
    min_tip_height_m: float = 0.003
    min_prior: float = 0.1

    def __post_init__(self) -> None:
        """Check the ranges."""
        _check("Relaxation", "min_alignment", self.min_alignment, 0.0, 1.0)
        _check("Relaxation", "max_opposition", self.max_opposition, -1.0, 0.0)
        _check("Relaxation", "clearance_m", self.clearance_m, _LEAST_CLEARANCE_M, 0.02)
        _check("Relaxation", "min_tip_height_m", self.min_tip_height_m, 0.0, 0.02)
        _check("Relaxation", "min_prior", self.min_prior, 0.0, 1.0)


# First let the noise of the cloud reach into the gripper's boxes, which at worst pushes a
# neighbour; then give up alignment, which costs grip.
_DEFAULT_RELAXATIONS = (
    Relaxation(min_alignment=0.4, max_opposition=-0.4, clearance_m=-0.001),
    Relaxation(min_alignment=0.3, max_opposition=-0.4, clearance_m=-0.001),
)
# Of what is 10 mm high, tips 3 mm over the table hold an edge of 7 mm, and its flanks, known by
# their outline alone, look blunt. 1 mm nearer to the table is still twice what the arm misses by.
_FLAT_RELAXATION = Relaxation(
    min_alignment=0.3, max_opposition=0.0, clearance_m=-0.001, min_tip_height_m=0.002,
    min_prior=0.02,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class AntipodalConfig:
    """Settings of `AntipodalSampler`.

    Attributes:
        gripper: The gripper whose boxes are checked.
        object_min_height_m: Points below belong to the table. Above the noise of a fused cloud
            (1 to 2 mm), below the thinnest object (8 mm).
        voxel_m: Spacing of the thinned cloud for contacts and the exact collision check.
            Averaging over it takes out most of the sensor's noise; a pad is five times as wide.
        scan_voxel_m: Spacing of the cloud for the search of finger placements, which is the
            dearest step and needs less detail.
        wall_step_m: Spacing of the points that close unseen vertical faces below an edge, so
            that a tilted approach does not enter an object through a side that no camera saw.
        seed_spacing_m: Spacing of the surface points from which grasps start: half a pad.
        max_seeds: Most seeds; bounds the run time.
        num_azimuths: Closing directions, spread evenly over half a turn, that all seeds share:
            the strips under all of them are measured at once.
        num_rolls: Closing directions a seed and tilt, out of these, spread over half a turn from
            the one that the surface suggests.
        tilts_deg: Approach angles from the vertical, about the closing direction.
        depths_m: How far beyond the seed the fingertips go, along the approach, ascending.
        min_alignment: Least mean cosine between the closing direction and the contact normals,
            on both sides. 0.4 is loose: normals are blurred by noise and unseen sides are judged
            by their outline; the prior tells good from bad.
        max_opposition: Largest cosine between the two mean contact normals; -1 is perfectly
            antipodal. Rejects wedges and corners, out of which an object slips.
        extra_opening_m: How much wider than the contact width the gripper opens for the
            approach, half of it on each side, capped at the gripper's stroke. Whoever executes a
            candidate must open as wide, not wider: this opening was checked for collisions.
        clearance_m: Free space demanded around the gripper's boxes; negative lets them overlap
            the cloud.
        min_tip_height_m: Least height of a fingertip over the table.
        pregrasp_m: Length of the straight approach that is swept for collisions.
        wrist_half_m: Half extents (x, y) of a box around the arm's last link behind the palm;
            the wrist of a UR5 is 75 mm across.
        wrist_length_m: Length of that box, from the flange.
        max_placements: Most finger placements whose contacts are examined, shared out among the
            seeds; bounds the run time.
        max_survivors: Most grasps that reach the exact collision check; bounds the run time.
        min_prior: Least prior of a candidate; of those below, one in ten is antipodal.
        max_chance_of_two: Largest probability that the fingers close on two objects.
        max_candidates: Most candidates returned.
        nms_distance_m: Candidates closer than this, and ...
        nms_angle_deg: ... turned by less than this, count as one; the better stays.
        cell_m: Edge of the square cells on the table over which candidates are spread.
        max_per_cell: Most candidates in a cell, so that large objects leave room for small ones.
        relaxations: Further passes, in this order, while nothing was found.
        flat: Last pass, for flat parts of the surface without a candidate; None for none.
        flat_height_m: Height over the table up to which something is flat.

    Raises:
        ConfigError: If a value is out of its range.
    """

    gripper: GripperGeometry = field(default=ROBOTIQ_2F85_CLASS)
    object_min_height_m: float = 0.0045
    voxel_m: float = 0.004
    scan_voxel_m: float = 0.005
    wall_step_m: float = 0.005
    seed_spacing_m: float = 0.011
    max_seeds: int = 450
    num_azimuths: int = 24
    num_rolls: int = 6
    tilts_deg: tuple[float, ...] = (0.0, 25.0, -25.0, 50.0, -50.0)
    depths_m: tuple[float, ...] = (0.006, 0.013, 0.022, 0.032)
    min_alignment: float = 0.4
    max_opposition: float = -0.4
    extra_opening_m: float = 0.02
    clearance_m: float = 0.0
    min_tip_height_m: float = 0.003
    pregrasp_m: float = 0.10
    wrist_half_m: tuple[float, float] = (0.038, 0.038)
    wrist_length_m: float = 0.10
    max_placements: int = 1600
    max_survivors: int = 550
    min_prior: float = 0.1
    max_chance_of_two: float = 0.4
    max_candidates: int = 180
    nms_distance_m: float = 0.008
    nms_angle_deg: float = 20.0
    cell_m: float = 0.04
    max_per_cell: int = 8
    relaxations: tuple[Relaxation, ...] = _DEFAULT_RELAXATIONS
    flat: Relaxation | None = _FLAT_RELAXATION
    flat_height_m: float = 0.018

    def __post_init__(self) -> None:
        """Check the ranges."""
        owner = type(self).__name__
        for name in _POSITIVE:
            if not getattr(self, name) > 0:
                raise ConfigError(
                    f"{owner}: {name} is {getattr(self, name)}, expected more than 0."
                )
        for name in _NOT_NEGATIVE:
            if not getattr(self, name) >= 0:
                raise ConfigError(f"{owner}: {name} is {getattr(self, name)}, expected 0 or more.")
        for name in _COUNTS:
            if getattr(self, name) < 1:
                raise ConfigError(f"{owner}: {name} is {getattr(self, name)}, expected 1 or more.")
        _check(owner, "min_alignment", self.min_alignment, 0.0, 1.0)
        _check(owner, "min_prior", self.min_prior, 0.0, 1.0)
        _check(owner, "max_chance_of_two", self.max_chance_of_two, 0.0, 1.0)
        _check(owner, "max_opposition", self.max_opposition, -1.0, 0.0)
        _check(owner, "clearance_m", self.clearance_m, _LEAST_CLEARANCE_M, 0.02)
        self._check_lists(owner)

    def _check_lists(self, owner: str) -> None:
        steepest = max(map(abs, self.tilts_deg), default=float("nan"))
        if not steepest <= _LARGEST_TILT_DEG:
            raise ConfigError(
                f"{owner}: tilts_deg is {self.tilts_deg}, expected at least one angle, all within "
                f"{_LARGEST_TILT_DEG:g} degrees of the vertical."
            )
        pairs = zip((0.0, *self.depths_m), self.depths_m, strict=False)
        if not self.depths_m or not all(shallow < deep for shallow, deep in pairs):
            raise ConfigError(
                f"{owner}: depths_m is {self.depths_m}, expected at least one, more than 0 and "
                "ascending."
            )

    @property
    def passes(self) -> tuple[Relaxation, ...]:
        """The thresholds of every pass: the configured ones, then the relaxations."""
        first = Relaxation(
            min_alignment=self.min_alignment,
            max_opposition=self.max_opposition,
            clearance_m=self.clearance_m,
            min_tip_height_m=self.min_tip_height_m,
            min_prior=self.min_prior,
        )
        return (first, *self.relaxations)
