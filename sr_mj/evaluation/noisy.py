"""A policy that sees its points through noise, for the robustness suite."""

from dataclasses import replace

import numpy as np

from policy.actions import ActionCandidates, ActionScores
from policy.base import Policy
from policy.observation import Observation


class NoisyPoints:
    """Moves every point before another policy looks at the cloud.

    The paper adds Gaussian noise of 0.1, 0.2 and 0.3 to the point cloud and gives no unit. Here one
    unit is half the extent of the workspace along each axis, that is, coordinates normalised to
    [-1, 1] as the network reads them: 0.1 moves a point by 22 mm on the table and 20 mm in height.
    Only what the policy sees is moved; candidates come from the cloud as it was perceived.

    Args:
        policy: The policy to be disturbed.
        sigma: Standard deviation, in half extents of the workspace.
    """

    def __init__(self, policy: Policy, sigma: float) -> None:
        """Wrap a policy."""
        self._policy, self._sigma = policy, sigma
        self.name = policy.name

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Let the policy score what it sees after the noise.

        Args:
            observation: What would be seen without noise.
            candidates: K candidates.
            rng: Source of the policy's draws, which do not change; the noise has its own.

        Returns:
            K scores.
        """
        (noise,) = rng.spawn(1)
        half_m = (observation.workspace_max - observation.workspace_min) / 2
        shift = noise.standard_normal(observation.points.shape) * (self._sigma * half_m)
        moved = (observation.points + shift).astype(np.float32)
        return self._policy.score(replace(observation, points=moved), candidates, rng)
