"""Scaled dot-product attention over padded sets, shared by both stages."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from policy.network.projections import ProjectedAttention


def masked_softmax(scores: Float[Tensor, "*dims"], mask: Bool[Tensor, "*#dims"]) -> Tensor:
    """Softmax over the last axis among the entries that are valid.

    Args:
        scores: Scores of any shape.
        mask: True where an entry is valid; broadcastable to the scores.

    Returns:
        Weights of the shape of the scores; invalid entries get 0. A row without a valid entry
        gets zeros instead of NaN.
    """
    # Finite, so that a row without a valid entry stays finite until it is zeroed. Sums and
    # products with a small mask cost one pass over the scores each, masked_fill costs two.
    penalty = torch.zeros_like(mask, dtype=scores.dtype)
    penalty.masked_fill_(~mask, torch.finfo(scores.dtype).min)
    return (scores + penalty).softmax(dim=-1) * mask


def scaled_scores(
    queries: Float[Tensor, "batch heads queries head_dim"],
    keys: Float[Tensor, "batch heads keys head_dim"],
) -> Float[Tensor, "batch heads queries keys"]:
    """QKᵀ/√d, the argument of the softmax in eq. (4)."""
    return (queries / math.sqrt(queries.shape[-1])) @ keys.transpose(-1, -2)


class MultiHeadAttention(ProjectedAttention):
    """Multi-head attention, softmax(QKᵀ/√d)V (eq. 4), with a mask for padded keys."""

    def __init__(self, width: int, num_heads: int) -> None:
        """Make the projections.

        Args:
            width: Channels of queries, keys, values and output.
            num_heads: Heads; divides the width.
        """
        # A bias on the keys shifts all scores of a query alike, which the softmax cancels.
        super().__init__(width, num_heads, key_bias=False)

    def weights(
        self,
        queries: Float[Tensor, "batch queries width"],
        keys: Float[Tensor, "batch keys width"],
        key_mask: Bool[Tensor, "batch keys"],
        bias: Float[Tensor, "batch heads queries keys"] | None = None,
    ) -> Float[Tensor, "batch heads queries keys"]:
        """Attention of every query on the keys.

        Args:
            queries: What asks.
            keys: What is compared with the queries.
            key_mask: True for real keys, False for padding.
            bias: Added to the scores.

        Returns:
            Rows that sum to 1, or to 0 where no key is valid.
        """
        scores = scaled_scores(*self.queries_and_keys(queries, keys))
        return masked_softmax(scores if bias is None else scores + bias, key_mask[:, None, None])
