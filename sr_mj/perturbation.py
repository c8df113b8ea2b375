"""Errors of the executed pose, for the robustness suites."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from sr_mj.errors import ConfigError

_LARGEST_M, _LARGEST_DEG = 0.1, 90.0


@dataclass(frozen=True, kw_only=True)
class PosePerturbation:
    """Normally distributed errors of position and orientation.

    The choice is made, and found to be feasible, among the poses as they were proposed; what is
    executed is the chosen pose with its error, even if it touches something.

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

    def apply(self, candidates: ActionCandidates, rng: np.random.Generator) -> ActionCandidates:
        """Return the candidates with an error each.

        Args:
            candidates: K poses.
            rng: Source of randomness.

        Returns:
            K poses: moved in the world, turned about the tool point.
        """
        shift = rng.normal(0.0, 1.0, (len(candidates), 3)) * self.sigma_m
        turn = rng.normal(0.0, 1.0, (len(candidates), 3)) * np.radians(self.sigma_deg)
        poses = candidates.Ts_world_tool.copy()
        poses[:, :3, 3] += shift
        poses[:, :3, :3] = Rotation.from_rotvec(turn).as_matrix() @ poses[:, :3, :3]
        return ActionCandidates(
            kind=candidates.kind,
            Ts_world_tool=poses,
            width_m=candidates.width_m,
            prior=candidates.prior,
        )
