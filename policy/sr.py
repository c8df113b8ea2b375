"""The learnt policy: the SR network behind the protocol of all policies."""

import numpy as np
import torch

from policy.actions import ActionCandidates
from policy.explanation import PolicyExplanation
from policy.learnt import LearntPolicy
from policy.network.batch import choose_points
from policy.network.config import SRConfig
from policy.network.model import SRNetwork
from policy.observation import Observation


class SRPolicy(LearntPolicy[SRNetwork]):
    """Scores candidates with the SR network (paper, section 3.3 and 3.4)."""

    name = "sr"
    variant = "sr"
    network_type = SRNetwork

    @classmethod
    def untrained(cls, config: SRConfig, rng: np.random.Generator) -> "SRPolicy":
        """Make a policy with random weights, for tests and timing.

        Args:
            config: Size and variant of the network.
            rng: Seeds the weights; the same state gives the same weights.

        Returns:
            The policy.
        """
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(int(rng.integers(2**63)))
            return cls(SRNetwork(config))

    def explain(self, observation: Observation, candidates: ActionCandidates) -> PolicyExplanation:
        """Repeat a decision and show what it attended to.

        Args:
            observation: The scene's feature cloud and the instruction.
            candidates: K candidates; K may be 0.

        Returns:
            The semantic mask on the M points that the network looks at, alpha of every layer of
            dense-sparse self-attention, and the candidates' logits.

        Raises:
            InvalidArrayError: If the features have another size than the network's.
        """
        chosen = choose_points(observation, self.network.config)
        batch = self._batch(observation, candidates, chosen)
        with torch.inference_mode():
            mask = self.network.semantic_mask(batch)[0, :, : len(chosen)]
            alpha, logits = self.network.alpha(), self.network(batch).logits[0, : len(candidates)]
        return PolicyExplanation(
            points=observation.points[chosen],
            mask=mask.cpu().numpy(),
            alpha=alpha.cpu().numpy(),
            logits=logits.cpu().numpy(),
        )
