"""What every policy offers."""

from typing import Protocol, runtime_checkable

import numpy as np

from policy.actions import ActionCandidates, ActionScores
from policy.observation import Observation


@runtime_checkable
class Policy(Protocol):
    """Scores the candidates of one decision.

    Attributes:
        name: Name under which results are reported.
    """

    @property
    def name(self) -> str:
        """Name under which results are reported."""
        ...

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Score every candidate.

        Args:
            observation: The scene's feature cloud and the instruction.
            candidates: K candidates; K may be 0.
            rng: The only source of randomness; most policies draw nothing from it.

        Returns:
            K scores, in the order of the candidates.
        """
        ...
