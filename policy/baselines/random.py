"""A policy that ignores what it sees: the floor of every comparison."""

import numpy as np

from policy.actions import ActionCandidates, ActionScores
from policy.observation import Observation


class RandomPolicy:
    """Chooses uniformly among the candidates."""

    name = "random"

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Draw one independent Gumbel variate for each candidate.

        The largest of independent Gumbel variates is an exactly uniform choice, and the order of
        the others is a uniform order of second choices.

        Args:
            observation: Not used.
            candidates: K candidates; only their number matters.
            rng: Source of the draws.

        Returns:
            K random logits.
        """
        del observation
        return ActionScores(logits=rng.gumbel(size=len(candidates)))
