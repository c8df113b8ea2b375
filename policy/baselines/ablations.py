"""The paper's ablations of the SR network (table 3), under names of their own."""

from collections.abc import Collection
from pathlib import Path
from typing import ClassVar

from policy.errors import InvalidCheckpointError, MissingCheckpointError
from policy.network.checkpoint import load_checkpoint
from policy.network.config import Ablation, ablation_switches
from policy.sr import DEFAULT_CHECKPOINT, SRPolicy


class _AblatedPolicy(SRPolicy):
    """The learnt policy with a part of its network left out."""

    variant: ClassVar[Ablation]

    @classmethod
    def from_checkpoint(
        cls, path: Path | None = None, *, encoder: str | Collection[str] | None = None
    ) -> SRPolicy:
        """Load trained weights of this variant.

        Args:
            path: File of the weights, with its card beside it; None for those shipped.
            encoder: Fingerprint of the encoder whose features it will get, or several that stand
                for it; None to take any.

        Returns:
            The policy.

        Raises:
            MissingCheckpointError: If the weights or their card are missing.
            InvalidCheckpointError: If they can't be read, were trained on another encoder's
                features, or are those of another variant.
        """
        path = path or DEFAULT_CHECKPOINT.with_stem(cls.variant)
        missing = [str(p) for p in (path, path.with_suffix(".json")) if not p.is_file()]
        if missing:
            raise MissingCheckpointError(
                f"No weights for the policy {cls.name!r}: missing {' and '.join(missing)}. Train "
                f"them with python -m policy.train --variant {cls.variant} and pass "
                "checkpoint=FILE.safetensors, or use the policy 'grounding', which needs none."
            )
        network = load_checkpoint(path, encoder=encoder)
        for switch in ("one_align", "dssa"):
            expected = ablation_switches(cls.variant)[switch]
            if getattr(network.config, switch) is not expected:
                raise InvalidCheckpointError(
                    f"{path}: got a network with {switch}={not expected}, expected {expected} for "
                    f"the policy {cls.name!r}. Choose weights trained with --variant "
                    f"{cls.variant}, or the policy that these belong to."
                )
        return cls(network)


class BasePolicy(_AblatedPolicy):
    """BASE: candidates attend to the visual features themselves; stage 2 alone."""

    name = "base"
    variant = "base"


class SRAPolicy(_AblatedPolicy):
    """SR-A: both stages, without dense-sparse self-attention between them."""

    name = "sr-a"
    variant = "sr_a"
