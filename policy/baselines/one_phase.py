"""What the baselines share that have something to say in one phase only."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from policy.actions import ActionCandidates, ActionKind, ActionScores
from policy.grounding import GroundingPolicy
from policy.observation import Observation


class OnePhasePolicy(ABC):
    """A policy with a rule of its own for one phase; in the other, it is the policy `grounding`.

    Attributes:
        name: Name under which results are reported.
        phase: Kind of the candidates that the rule is for.
    """

    name: ClassVar[str]
    phase: ClassVar[ActionKind] = "pick"

    def __init__(self) -> None:
        """Make the policy."""
        self._other_phase = GroundingPolicy()

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Score candidates of the policy's phase by its own rule, others as `grounding` does.

        Args:
            observation: What the robot sees, and the instruction.
            candidates: K candidates; K may be 0.
            rng: Most rules draw nothing from it, and `grounding` does not either.

        Returns:
            K logits. The class says how the rule makes them.
        """
        if candidates.kind != self.phase:
            return self._other_phase.score(observation, candidates, rng)
        return ActionScores(logits=self._logits(observation, candidates, rng))

    @abstractmethod
    def _logits(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> Float[np.ndarray, " K"]:
        """Rule of the policy, for candidates of its phase."""
