"""What training and policies need of a network that scores candidates."""

from abc import abstractmethod
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor, nn

from policy.network.batch import DecisionBatch
from policy.network.config import NetworkConfig
from policy.network.decoder import NetworkOutput


class CandidateNetwork(nn.Module):
    """A network over padded batches of decisions.

    Attributes:
        config_type: Class of its configuration.
        config: Size and variant.
    """

    config_type: ClassVar[type[NetworkConfig]]
    config: NetworkConfig

    @abstractmethod
    def forward(self, batch: DecisionBatch) -> NetworkOutput:
        """Score the candidates of a batch of decisions.

        Args:
            batch: B decisions, padded to N points, T tokens and K candidates.

        Returns:
            Scores (B, K), minus infinity on padding, and the decoded action parameters.
        """

    @property
    def masking(self) -> nn.Module | None:
        """The part whose second argument is a mask on the points; None without one."""
        return None

    def alpha(self) -> Float[Tensor, "layers 2"]:
        """Weights of the sparse and the dense branch of every layer that has both."""
        return torch.zeros(0, 2)
