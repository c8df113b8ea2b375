"""What the trained baselines share: candidates as they enter a network, and how they leave it."""

import math
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn
from torch.nn.functional import softplus

from policy.network.batch import PHASES, DecisionBatch
from policy.network.config import NetworkConfig
from policy.network.decoder import ActionDecoder, NetworkOutput
from policy.network.encoding import fourier_features, mlp, num_fourier_features
from policy.network.mixing import MixingModule

# As in the SR network: between two grasps of one object.
_INITIAL_PRIOR_WEIGHT = 2.0


@dataclass(frozen=True, kw_only=True)
class BaselineConfig(NetworkConfig):
    """What the trained baselines get to know beside the cloud, the text and the poses.

    By default all that the SR network gets, so that a comparison is one of networks.

    Attributes:
        prior: Add the candidate generator's prior to the logit, times a learnt weight. The
            originals choose by the network alone.
        side: Tell the network whether a place is asked for inside or around the reference.
        num_fourier_bands: Octaves of the Fourier features of positions, as in the SR network.
    """

    prior: bool = True
    side: bool = True
    num_fourier_bands: int = 6

    def __post_init__(self) -> None:
        """Check the ranges."""
        super().__post_init__()
        self._check_positive("num_fourier_bands")


class CandidateTokens(nn.Module):
    """A three-layer MLP of each candidate's pose, and what is to be done with it."""

    def __init__(self, config: BaselineConfig) -> None:
        """Make the layers.

        Args:
            config: Size of the network.
        """
        super().__init__()
        self.uses_side = config.side
        self.num_bands = config.num_fourier_bands
        width = config.width
        self.pose = mlp(7 + num_fourier_features(self.num_bands), width, width, width)
        self.phase = nn.Embedding(len(PHASES), width)

    def forward(self, batch: DecisionBatch) -> Float[Tensor, "batch candidates width"]:
        """Embed the candidates.

        Args:
            batch: B decisions.

        Returns:
            One row a candidate.
        """
        waves = fourier_features(batch.poses[..., :3], self.num_bands)
        rows = self.pose(torch.cat([batch.poses, waves], dim=-1))
        return rows + self.phase(self.known_phase(batch))[:, None]

    def known_phase(self, batch: DecisionBatch) -> Int[Tensor, " batch"]:
        """Index into `PHASES`, without the side if that is not to be known."""
        return batch.phase if self.uses_side else batch.phase.clamp(max=1)


class CandidateScores(MixingModule):
    """A three-layer MLP gives the score, with the prior added, and the same decoder as SR's."""

    def __init__(self, config: BaselineConfig) -> None:
        """Make the layers.

        Args:
            config: Size of the network and limits of the outputs.
        """
        super().__init__()
        width = config.width
        self.hidden = nn.Sequential(mlp(width, width, width), nn.GELU())
        # Its inner product with a learnt query is the third layer.
        self.decoder = ActionDecoder(config)
        self.prior_weight: nn.Parameter | None = None
        if config.prior:
            # Through a softplus, since a better candidate is never a reason against it.
            raw = math.log(math.expm1(_INITIAL_PRIOR_WEIGHT))
            self.prior_weight = nn.Parameter(torch.full((len(PHASES),), raw))

    def forward(
        self,
        states: Float[Tensor, "batch candidates width"],
        phase: Int[Tensor, " batch"],
        batch: DecisionBatch,
    ) -> NetworkOutput:
        """Read out every candidate.

        Args:
            states: One state a candidate.
            phase: Index into `PHASES`, as far as it is to be known.
            batch: B decisions.

        Returns:
            Scores, minus infinity on padding, and action parameters.
        """
        output = self.decoder(self.hidden(states))
        logits = output.logits
        if self.prior_weight is not None:
            logits = logits + softplus(self.prior_weight)[phase][:, None] * batch.prior
        return replace(output, logits=logits.masked_fill(~batch.candidate_mask, float("-inf")))
