"""The learnt policy: the SR network behind the protocol of all policies."""

from pathlib import Path

import numpy as np
import torch

from policy.actions import ActionCandidates, ActionDecoding, ActionScores
from policy.network.batch import collate, make_sample
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
    def from_checkpoint(cls, path: Path) -> "SRPolicy":
        """Load trained weights.

        Args:
            path: File of the weights, with its card beside it.

        Returns:
            The policy.

        Raises:
            MissingCheckpointError: If the weights or their card are missing.
            InvalidCheckpointError: If they can't be read or don't fit.
        """
        return cls(load_checkpoint(path))

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
        sample = make_sample(observation, candidates, self.network.config)
        num_candidates = len(candidates)
        device = next(self.network.parameters()).device
        with torch.inference_mode():
            output = self.network(collate([sample]).to(device))
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
