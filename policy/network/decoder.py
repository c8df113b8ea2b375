"""Reading scores and action parameters out of the candidates' states (section 3.4.2)."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn

from policy.network.config import NetworkConfig
from policy.network.encoding import mlp

# Size of the learnt query at the start: small enough for the prior and the semantic mask to decide
# before training, and not the noise of random weights.
_INITIAL_QUERY = 0.3


@dataclass(frozen=True, kw_only=True)
class NetworkOutput:
    """What the network says about every candidate of a batch.

    Attributes:
        logits: (B, K) scores; minus infinity on padding.
        rotvec_tool: (B, K, 3) correction of the orientation, rotation vector in the tool frame,
            radians.
        opening_m: (B, K) finger opening before the contact, metres.
        avoid_collision_logit: (B, K) logit of a_col, whether the approach needs collision
            avoidance.
    """

    logits: Tensor
    rotvec_tool: Tensor
    opening_m: Tensor
    avoid_collision_logit: Tensor


class ActionDecoder(nn.Module):
    """Inner product with a learnt query for the score, a three-layer MLP for the rest."""

    def __init__(self, config: NetworkConfig) -> None:
        """Make the heads.

        Args:
            config: Size of the network and limits of the outputs.
        """
        super().__init__()
        width = config.width
        self.max_opening_m = config.max_opening_m
        self.max_refinement_rad = config.max_refinement_rad
        self.query = nn.Parameter(_INITIAL_QUERY * torch.randn(width))
        self.hidden = nn.Sequential(mlp(width, width, width), nn.GELU())
        self.rotation = nn.Linear(width, 3)
        self.opening = nn.Linear(width, 1)
        self.avoid_collision = nn.Linear(width, 1)
        # No correction until one is learnt.
        nn.init.zeros_(self.rotation.weight)
        nn.init.zeros_(self.rotation.bias)

    def forward(self, states: Float[Tensor, "batch candidates width"]) -> NetworkOutput:
        """Read out every candidate; the caller uses the row of the chosen one.

        Args:
            states: One state a candidate.

        Returns:
            Scores and action parameters, nothing masked yet.
        """
        hidden = self.hidden(states)
        raw = self.rotation(hidden)
        # Smooth at zero, and never longer than the limit.
        rotvec = self.max_refinement_rad * raw / (1 + raw.square().sum(-1, keepdim=True)).sqrt()
        return NetworkOutput(
            # The argument of the softmax that gives w(a_k | I, L) in eq. (13) and (14).
            logits=states @ self.query / math.sqrt(len(self.query)),
            rotvec_tool=rotvec,
            opening_m=self.max_opening_m * self.opening(hidden).squeeze(-1).sigmoid(),
            avoid_collision_logit=self.avoid_collision(hidden).squeeze(-1),
        )
