"""What a policy with attention attended to in one decision, as arrays."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from policy.actions import ActionCandidates
from policy.arrays import check_range, checked_array
from policy.errors import InvalidArrayError
from policy.observation import Observation


@dataclass(frozen=True, kw_only=True)
class PolicyExplanation:
    """The inside of one decision. Arrays are copied, checked and made read-only.

    Attributes:
        points: (M, 3) float32 points that the policy looked at, in the world, metres.
        mask: (H, M) float32 semantic mask of stage 1 for each head: how much each point matters to
            the instruction. Its mean over the points is 1.
        alpha: (L, 2) float32 weights of the sparse and the dense branch in each layer of
            dense-sparse self-attention; L is 0 for a network without it.
        logits: (K,) float32 scores of the candidates.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    points: np.ndarray
    mask: np.ndarray
    alpha: np.ndarray
    logits: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        sizes: dict[str, int] = {}
        shapes: dict[str, tuple[int | str, ...]] = {
            "points": ("M", 3),
            "mask": ("H", "M"),
            "alpha": ("L", 2),
            "logits": ("K",),
        }
        for name, shape in shapes.items():
            array = checked_array(name, getattr(self, name), shape, sizes=sizes)
            object.__setattr__(self, name, array)
        check_range("mask", self.mask, 0.0)
        check_range("alpha", self.alpha, 0.0, 1.0)
        if not sizes["H"]:
            raise InvalidArrayError("mask: got 0 heads, expected at least 1.")

    @property
    def mean_mask(self) -> np.ndarray:
        """(M,) float32 mask averaged over the heads."""
        return self.mask.mean(axis=0)


@runtime_checkable
class ExplainingPolicy(Protocol):
    """A policy that can show what it attended to."""

    def explain(self, observation: Observation, candidates: ActionCandidates) -> PolicyExplanation:
        """Repeat a decision and show what it attended to.

        Args:
            observation: The scene's feature cloud and the instruction.
            candidates: K candidates; K may be 0.

        Returns:
            Mask, weights of the branches, and the same logits as `score` gives.
        """
        ...
