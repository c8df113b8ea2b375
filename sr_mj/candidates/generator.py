"""The protocols behind which generators of grasp and place candidates stand."""

from typing import Protocol, runtime_checkable

import numpy as np

from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates
from sr_mj.candidates.held import HeldObject


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


@runtime_checkable
class PlaceGenerator(Protocol):
    """Proposes places for what is held, from what the cameras saw and from nothing else."""

    def place(
        self, cloud: GeometryCloud, held: HeldObject, rng: np.random.Generator
    ) -> ActionCandidates:
        """Propose poses at which the gripper may open.

        Args:
            cloud: Fused cloud in world coordinates without the held object, the table at z = 0;
                points of the table may be present.
            held: What the gripper holds.
            rng: Source of randomness; the same state gives the same bytes.

        Returns:
            Candidates of kind "place", best prior first; none at all is a normal result.
        """
        ...
