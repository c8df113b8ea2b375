"""The paper's ablations of the SR network (table 3), under names of their own."""

from pathlib import Path
from typing import ClassVar

from policy.errors import InvalidCheckpointError
from policy.network.config import Ablation, ablation_switches
from policy.network.model import SRNetwork
from policy.sr import SRPolicy


class _AblatedPolicy(SRPolicy):
    """The learnt policy with a part of its network left out."""

    variant: ClassVar[Ablation]

    @classmethod
    def check_network(cls, network: SRNetwork, path: Path) -> None:
        """Refuse a network with other parts.

        Args:
            network: What was loaded.
            path: From where.

        Raises:
            InvalidCheckpointError: If it is another variant.
        """
        for switch in ("one_align", "dssa"):
            expected = ablation_switches(cls.variant)[switch]
            if getattr(network.config, switch) is not expected:
                raise InvalidCheckpointError(
                    f"{path}: got a network with {switch}={not expected}, expected {expected} for "
                    f"the policy {cls.name!r}. Choose weights trained with --variant "
                    f"{cls.variant}, or the policy that these belong to."
                )


class BasePolicy(_AblatedPolicy):
    """BASE: candidates attend to the visual features themselves; stage 2 alone."""

    name = "base"
    variant = "base"


class SRAPolicy(_AblatedPolicy):
    """SR-A: both stages, without dense-sparse self-attention between them."""

    name = "sr-a"
    variant = "sr_a"
