"""Errors of the executed pose, for the robustness suites."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from sr_mj.errors import ConfigError

_LARGEST_M, _LARGEST_DEG = 0.1, 90.0
_RISE_M, _NUM_RISES = 0.005, 20


@dataclass(frozen=True, kw_only=True)
class PosePerturbation:
    """Normally distributed errors of position and orientation.

    The choice is made, and found to be feasible, among the poses as they were proposed; what is
    executed is the chosen pose with its error, even if it touches something. One that would be in
    the table is raised to where it is not (`raised`).

    Attributes:
        sigma_m: Standard deviation of the position along each axis, metres.
        sigma_deg: Standard deviation of the rotation about each axis, degrees.

    Raises:
        ConfigError: If a value is negative or absurdly large.
    """

    sigma_m: float = 0.0
    sigma_deg: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0 <= self.sigma_m <= _LARGEST_M:
            raise ConfigError(
                f"Perturbation of positions is {self.sigma_m * 100:g} cm; expected 0 to "
                f"{_LARGEST_M * 100:g}."
            )
        if not 0 <= self.sigma_deg <= _LARGEST_DEG:
            raise ConfigError(
                f"Perturbation of orientations is {self.sigma_deg:g} degrees; expected 0 to "
                f"{_LARGEST_DEG:g}."
            )

    def draw(self, rng: np.random.Generator) -> "PoseError":
        """Draw an error.

        Args:
            rng: Source of randomness.

        Returns:
            The error of one action.
        """
        shift = rng.normal(0.0, 1.0, 3) * self.sigma_m
        turn = rng.normal(0.0, 1.0, 3) * np.radians(self.sigma_deg)
        return PoseError(shift_m=shift, turn_rad=turn)


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseError:
    """What lies between the pose that was chosen and the one that is executed.

    Attributes:
        shift_m: (3,) metres along the axes of the world.
        turn_rad: (3,) rotation vector about the tool point, in the axes of the world.
    """

    shift_m: np.ndarray
    turn_rad: np.ndarray

    def apply(self, candidates: ActionCandidates) -> ActionCandidates:
        """Return poses with this error.

        Args:
            candidates: K poses.

        Returns:
            K poses: moved in the world, turned about the tool point.
        """
        poses = candidates.Ts_world_tool.copy()
        poses[:, :3, 3] += self.shift_m
        poses[:, :3, :3] = Rotation.from_rotvec(self.turn_rad).as_matrix() @ poses[:, :3, :3]
        return replace(candidates, Ts_world_tool=poses)


def raised(candidates: ActionCandidates) -> ActionCandidates:
    """Return a pose, and those over it, the lowest first.

    An arm that is sent into the table ends on it: of these poses, that is the first to which it can
    go.

    Args:
        candidates: One pose.

    Returns:
        The pose, and others every 5 mm up to 10 cm over it.
    """
    rises = np.arange(_NUM_RISES + 1) * _RISE_M
    poses = candidates.take(np.zeros(len(rises), int))
    T_world_tool = poses.Ts_world_tool.copy()
    T_world_tool[:, 2, 3] += rises
    return replace(poses, Ts_world_tool=T_world_tool)
