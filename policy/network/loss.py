"""Training targets and losses (section 3.4.3)."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from policy.arrays import check_range, checked_array
from policy.errors import InvalidArrayError
from policy.network.config import NetworkConfig
from policy.network.decoder import NetworkOutput
from policy.network.padding import pad


@dataclass(frozen=True, kw_only=True)
class ExpertTarget:
    """What the expert says about the candidates of one decision.

    Attributes:
        positive: (K,) bool, at least one True. For a pick the candidate closest to the expert's
            action; for a place every candidate in the valid region.
        opening_m: (K,) float32 finger opening, metres: the candidate's contact width.
        avoid_collision: (K,) float32, 1 where the straight approach collides, else 0.
        rotvec_tool: (K, 3) float32 rotation from the candidate to the expert's orientation, as a
            rotation vector in the tool frame, radians.

    Only the rows of positive candidates count in the last three.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or nothing is positive.
    """

    positive: np.ndarray
    opening_m: np.ndarray
    avoid_collision: np.ndarray
    rotvec_tool: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        positive = np.array(self.positive)
        if positive.dtype != np.bool_ or positive.ndim != 1 or not positive.any():
            raise InvalidArrayError(
                f"positive: got {np.count_nonzero(positive)} positives in {positive.dtype} of "
                f"shape {positive.shape}, expected bool (K,) with at least 1 positive."
            )
        positive.flags.writeable = False
        sizes = {"K": len(positive)}
        opening_m = checked_array("opening_m", self.opening_m, ("K",), sizes=sizes)
        avoid = checked_array("avoid_collision", self.avoid_collision, ("K",), sizes=sizes)
        rotvec = checked_array("rotvec_tool", self.rotvec_tool, ("K", 3), sizes=sizes)
        check_range("opening_m", opening_m, 0.0)
        check_range("avoid_collision", avoid, 0.0, 1.0)
        object.__setattr__(self, "positive", positive)
        object.__setattr__(self, "opening_m", opening_m)
        object.__setattr__(self, "avoid_collision", avoid)
        object.__setattr__(self, "rotvec_tool", rotvec)


@dataclass(frozen=True, kw_only=True)
class ExpertTargetBatch:
    """Targets of B decisions, padded to K candidates.

    Attributes:
        positive: (B, K) bool; False on padding.
        opening_m: (B, K) metres.
        avoid_collision: (B, K) 0 or 1.
        rotvec_tool: (B, K, 3) radians.
    """

    positive: Tensor
    opening_m: Tensor
    avoid_collision: Tensor
    rotvec_tool: Tensor

    def to(self, device: torch.device | str) -> "ExpertTargetBatch":
        """Copy every tensor to a device."""
        return ExpertTargetBatch(**{f.name: getattr(self, f.name).to(device) for f in fields(self)})


def collate_targets(targets: Sequence[ExpertTarget]) -> ExpertTargetBatch:
    """Pad the targets of several decisions, as `collate` pads the decisions.

    Args:
        targets: At least one target.

    Returns:
        The padded targets, on the CPU.

    Raises:
        InvalidArrayError: If there are no targets.
    """
    if not targets:
        raise InvalidArrayError("targets: got 0, expected at least 1.")
    return ExpertTargetBatch(
        positive=pad([target.positive for target in targets])[0],
        opening_m=pad([target.opening_m for target in targets])[0],
        avoid_collision=pad([target.avoid_collision for target in targets])[0],
        rotvec_tool=pad([target.rotvec_tool for target in targets])[0],
    )


def choice_loss(
    logits: Float[Tensor, "batch candidates"], positive: Bool[Tensor, "batch candidates"]
) -> Float[Tensor, ""]:
    """Cross-entropy over the candidates, averaged over the decisions.

    Args:
        logits: Scores, minus infinity on padding.
        positive: The right candidates, at least one a decision. With several, as for places, the
            probability of choosing any of them counts.

    Returns:
        The mean loss.

    Raises:
        InvalidArrayError: If a decision has no positive among its real candidates.
    """
    has_positive = (positive & logits.isfinite()).any(dim=1)
    if not bool(has_positive.all()):
        raise InvalidArrayError(
            f"positive: got {int((~has_positive).sum())} decisions without a positive candidate, "
            "expected at least 1 in each."
        )
    # Eq. (15), L = -log w; for a region of positives -log of the sum of their w.
    chosen = logits.masked_fill(~positive, float("-inf")).logsumexp(dim=1)
    return (logits.logsumexp(dim=1) - chosen).mean()


def decoding_loss(
    output: NetworkOutput, targets: ExpertTargetBatch, config: NetworkConfig
) -> Float[Tensor, ""]:
    """Loss of the action parameters on the positive candidates.

    The paper trains on eq. (15) alone, which leaves the outputs of section 3.4.2 without a
    gradient; hence these terms. Each is relative to its output's range, so that they weigh alike.

    Args:
        output: What the network said.
        targets: What the expert did.
        config: Ranges of the outputs.

    Returns:
        Sum of the three terms, averaged over positives and then over decisions.
    """
    opening = ((output.opening_m - targets.opening_m) / config.max_opening_m).square()
    rotation = (output.rotvec_tool - targets.rotvec_tool) / config.max_refinement_rad
    avoid = functional.binary_cross_entropy_with_logits(
        output.avoid_collision_logit, targets.avoid_collision, reduction="none"
    )
    total = opening + rotation.square().sum(dim=-1) + avoid
    weight = targets.positive / targets.positive.sum(dim=1, keepdim=True)
    return (total * weight).sum(dim=1).mean()
