"""What is known of a candidate beside its state: its prior, and where the semantic mask lies."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn
from torch.nn.functional import softplus

from policy.network.batch import PHASES
from policy.network.bias import nearest_scale
from policy.network.config import SRConfig
from policy.network.mixing import MixingModule

# Weight of the prior at the start, in units of logit: between two grasps of one object.
_INITIAL_PRIOR_WEIGHT = 2.0
# Weight of the semantic mask at the start, over all heads that look at what is at the candidate.
# Their readout of a target exceeds the median candidate's by about 1: a target starts e^6 ahead.
_INITIAL_MASK_WEIGHT = 6.0
# Weight of the nearness to the mask at the start, and the scale that has it: 4 cm in the standard
# workspace. It orders the grasps among which none is at the mask, and little where one is.
_INITIAL_NEARNESS_WEIGHT = 6.0
_INITIAL_NEARNESS_SCALE = 0.2
_SMALLEST_NEARNESS = 1e-6


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What `CandidateEvidence` weighs, for every candidate of a batch.

    Attributes:
        prior: (B, K) the candidates' priors.
        readout: (B, H, K) what each head of stage 2 sees of the semantic mask.
        nearness: (B, S, K) logarithm of the nearness to the mask at every scale; None if unused.
    """

    prior: Tensor
    readout: Tensor
    nearness: Tensor | None


class CandidateEvidence(MixingModule):
    """Adds to the logits what is known of a candidate without the network."""

    def __init__(self, config: SRConfig) -> None:
        """Make the weights.

        Args:
            config: Which evidence to use.
        """
        super().__init__()
        num_phases, num_heads = len(PHASES), config.num_heads
        self.prior_weight: nn.Parameter | None = None
        self.mask_weight: nn.Parameter | None = None
        self.nearness_weight: nn.Parameter | None = None
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
        if config.mask_nearness:
            weight = torch.zeros(num_phases, config.num_bias_scales)
            scale = nearest_scale(config.num_bias_scales, _INITIAL_NEARNESS_SCALE)
            weight[PHASES.index("pick"), scale] = _INITIAL_NEARNESS_WEIGHT
            self.nearness_weight = nn.Parameter(weight)

    def forward(
        self, phase: Int[Tensor, " batch"], evidence: Evidence
    ) -> Float[Tensor, "batch candidates"]:
        """Weigh the evidence.

        Args:
            phase: Index into `PHASES`.
            evidence: What is known of the candidates.

        Returns:
            What is added to the logits.
        """
        logits = torch.zeros_like(evidence.prior)
        if self.prior_weight is not None:
            logits = logits + softplus(self.prior_weight)[phase][:, None] * evidence.prior
        for weight, seen in (
            (self.mask_weight, evidence.readout),
            (self.nearness_weight, evidence.nearness),
        ):
            if weight is not None and seen is not None:
                logits = logits + (weight[phase][:, :, None] * seen).sum(dim=1)
        return logits


def mask_nearness(
    radial: Float[Tensor, "batch scales candidates points"],
    mask: Float[Tensor, "batch heads points"],
) -> Float[Tensor, "batch scales candidates"]:
    """How near the points that matter are to a candidate, also where none is at it.

    Attention of stage 2 is relative: if nothing at a candidate matters, its heads do not see how
    far off that is which does.

    Args:
        radial: The radial functions φ_s of `candidate_basis`.
        mask: The semantic mask m of every head.

    Returns:
        log(Σ_i m_i φ_s(d_i) / Σ_i m_i) with the mask's mean over the heads: 0 if all of it is at
        the candidate, and about twice the logarithm of s / d far from it. The same number for
        every candidate where there are no points.
    """
    shared = mask.mean(dim=1).to(radial.dtype)
    weights = shared / shared.sum(dim=-1, keepdim=True).clamp(min=_SMALLEST_NEARNESS)
    nearness = (radial @ weights[:, None, :, None]).squeeze(-1)
    return nearness.clamp(min=_SMALLEST_NEARNESS).log()
