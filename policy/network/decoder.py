"""Reading scores and action parameters out of the candidates' states (section 3.4.2)."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn
from torch.nn.functional import softplus

from policy.network.batch import PHASES
from policy.network.config import NetworkConfig, SRConfig
from policy.network.encoding import mlp

# Size of the learnt query at the start: small enough for the prior and the semantic mask to decide
# before training, and not the noise of random weights.
_INITIAL_QUERY = 0.3
# Weight of the prior at the start, in units of logit: between two grasps of one object.
_INITIAL_PRIOR_WEIGHT = 2.0
# Weight of the semantic mask at the start, over all heads that look at what is at the candidate.
# Their readout of a target exceeds the median candidate's by about 1: a target starts e^6 ahead.
_INITIAL_MASK_WEIGHT = 6.0


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


class CandidateEvidence(nn.Module):
    """Adds what is known of a candidate without the network: its prior, and the mask at it."""

    def __init__(self, config: SRConfig) -> None:
        """Make the weights.

        Args:
            config: Which evidence to use.
        """
        super().__init__()
        num_phases, num_heads = len(PHASES), config.num_heads
        self.prior_weight: nn.Parameter | None = None
        self.mask_weight: nn.Parameter | None = None
        if config.prior:
            # Through a softplus, since a better grasp is never a reason against it.
            raw = math.log(math.expm1(_INITIAL_PRIOR_WEIGHT))
            self.prior_weight = nn.Parameter(torch.full((num_phases,), raw))
        if config.mask_readout:
            weight = torch.zeros(num_phases, num_heads)
            num_local = num_heads // 2 if config.candidate_bias else 0
            weight[:, :num_local] = _INITIAL_MASK_WEIGHT / max(num_local, 1)
            # A place around the reference is no place on it; how far off is left to training.
            weight[PHASES.index("place outside")] = 0.0
            self.mask_weight = nn.Parameter(weight)

    def forward(
        self,
        phase: Int[Tensor, " batch"],
        prior: Float[Tensor, "batch candidates"],
        readout: Float[Tensor, "batch heads candidates"],
    ) -> Float[Tensor, "batch candidates"]:
        """Weigh the evidence.

        Args:
            phase: Index into `PHASES`.
            prior: The candidates' priors.
            readout: What each head of stage 2 sees of the semantic mask.

        Returns:
            What is added to the logits.
        """
        logits = torch.zeros_like(prior)
        if self.prior_weight is not None:
            logits = logits + softplus(self.prior_weight)[phase][:, None] * prior
        if self.mask_weight is not None:
            logits = logits + (self.mask_weight[phase][:, :, None] * readout).sum(dim=1)
        return logits


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
