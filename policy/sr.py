"""The learnt policy: the SR network behind the protocol of all policies."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
import torch

from policy.actions import ActionCandidates, ActionDecoding, ActionScores
from policy.explanation import PolicyExplanation
from policy.network.batch import SRBatch, choose_points, collate, make_sample
from policy.network.checkpoint import load_checkpoint
from policy.network.config import SRConfig
from policy.network.model import SRNetwork
from policy.observation import Observation

DEFAULT_CHECKPOINT = Path(__file__).parent / "weights" / "sr.safetensors"


class SRPolicy:
    """Scores candidates with the SR network (paper, section 3.3 and 3.4)."""

    name = "sr"

    def __init__(self, network: SRNetwork) -> None:
        """Wrap a network.

        Args:
            network: The network; it's put into evaluation mode.
        """
        self.network = network.eval()

    @classmethod
    def from_checkpoint(
        cls, path: Path, *, encoder: str | Collection[str] | None = None
    ) -> "SRPolicy":
        """Load trained weights.

        Args:
            path: File of the weights, with its card beside it.
            encoder: Fingerprint of the encoder whose features it will get, or several that stand
                for it; None to take any.

        Returns:
            The policy.

        Raises:
            MissingCheckpointError: If the weights or their card are missing.
            InvalidCheckpointError: If they can't be read or don't fit, or were trained on another
                encoder's features.
        """
        return cls(load_checkpoint(path, encoder=encoder))

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

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Score every candidate; nothing is drawn from `rng`.

        Args:
            observation: The scene's feature cloud and the instruction.
            candidates: K candidates; K may be 0.
            rng: Not used.

        Returns:
            K logits with the decoded action parameters.

        Raises:
            InvalidArrayError: If the features have another size than the network's.
        """
        del rng
        num_candidates = len(candidates)
        with torch.inference_mode():
            output = self.network(self._batch(observation, candidates))
        # The batch has one row of padding if there are no candidates.
        rows = {
            "logits": output.logits,
            "rotvec_tool": output.rotvec_tool,
            "opening_m": output.opening_m,
            "avoid_collision": output.avoid_collision_logit.sigmoid(),
        }
        arrays = {name: rows[name][0, :num_candidates].cpu().numpy() for name in rows}
        logits = arrays.pop("logits")
        return ActionScores(logits=logits, decoding=ActionDecoding(**arrays))

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

    def _batch(
        self,
        observation: Observation,
        candidates: ActionCandidates,
        chosen: np.ndarray | None = None,
    ) -> SRBatch:
        sample = make_sample(observation, candidates, self.network.config, chosen=chosen)
        return collate([sample]).to(next(self.network.parameters()).device)
