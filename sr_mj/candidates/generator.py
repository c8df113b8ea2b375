"""The protocol behind which generators of grasp candidates stand."""

from typing import Protocol, runtime_checkable

import numpy as np

from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates


@runtime_checkable
class CandidateGenerator(Protocol):
    """Proposes grasps from what the cameras saw, and from nothing else."""

    def pick(self, cloud: GeometryCloud, rng: np.random.Generator) -> ActionCandidates:
        """Propose poses at which the gripper may close.

        Args:
            cloud: Fused cloud in world coordinates, the table at z = 0; points of the table may
                be present.
            rng: Source of randomness; the same state gives the same bytes.

        Returns:
            Candidates of kind "pick", best prior first; none at all is a normal result.
        """
        ...
