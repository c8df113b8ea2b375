"""What all policies with a trained network have in common."""

from collections.abc import Collection
from pathlib import Path
from typing import ClassVar, Generic, TypeVar

import numpy as np
import torch

from policy.actions import ActionCandidates, ActionDecoding, ActionScores
from policy.errors import MissingCheckpointError
from policy.network.base import CandidateNetwork
from policy.network.batch import DecisionBatch, collate, make_sample
from policy.network.checkpoint import load_checkpoint
from policy.observation import Observation

WEIGHTS = Path(__file__).parent / "weights"

Network = TypeVar("Network", bound=CandidateNetwork)


class LearntPolicy(Generic[Network]):
    """Scores candidates with a network.

    Attributes:
        name: Name under which results are reported.
        variant: What `python -m policy.train --variant` calls its network; also the stem of the
            file that is shipped.
        network_type: Class of its network.
        network: The network.
    """

    name: ClassVar[str]
    variant: ClassVar[str]
    network_type: type[Network]

    def __init__(self, network: Network) -> None:
        """Wrap a network.

        Args:
            network: The network; it's put into evaluation mode.
        """
        self.network: Network = network.eval()

    @classmethod
    def from_checkpoint(
        cls, path: Path | None = None, *, encoder: str | Collection[str] | None = None
    ) -> "LearntPolicy[Network]":
        """Load trained weights.

        Args:
            path: File of the weights, with its card beside it; None for those shipped.
            encoder: Fingerprint of the encoder whose features it will get, or several that stand
                for it; None to take any.

        Returns:
            The policy.

        Raises:
            MissingCheckpointError: If the weights or their card are missing.
            InvalidCheckpointError: If they can't be read or don't fit, are those of another
                network, or were trained on another encoder's features.
        """
        path = path or (WEIGHTS / cls.variant).with_suffix(".safetensors")
        missing = [str(p) for p in (path, path.with_suffix(".json")) if not p.is_file()]
        if missing:
            raise MissingCheckpointError(
                f"No weights for the policy {cls.name!r}: missing {' and '.join(missing)}. Train "
                f"them with python -m policy.train --variant {cls.variant} and pass "
                "checkpoint=FILE.safetensors, or use the policy 'grounding', which needs none."
            )
        network = load_checkpoint(path, cls.network_type, encoder=encoder)
        cls.check_network(network, path)
        return cls(network)

    @classmethod
    def check_network(cls, network: Network, path: Path) -> None:
        """Refuse a network of the right kind that is another variant; any will do here.

        Args:
            network: What was loaded.
            path: From where.

        Raises:
            InvalidCheckpointError: If it is another variant.
        """

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

    def _batch(
        self,
        observation: Observation,
        candidates: ActionCandidates,
        chosen: np.ndarray | None = None,
    ) -> DecisionBatch:
        sample = make_sample(observation, candidates, self.network.config, chosen=chosen)
        return collate([sample]).to(next(self.network.parameters()).device)
