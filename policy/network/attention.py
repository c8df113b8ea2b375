"""Scaled dot-product attention over padded sets, shared by both stages."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn


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


def split_heads(x: Float[Tensor, "batch items width"], num_heads: int) -> Tensor:
    """Split channels into heads: (batch, items, width) to (batch, heads, items, head_dim)."""
    return x.unflatten(-1, (num_heads, -1)).transpose(1, 2)


def merge_heads(x: Float[Tensor, "batch heads items head_dim"]) -> Tensor:
    """Concatenate heads: (batch, heads, items, head_dim) to (batch, items, width)."""
    return x.transpose(1, 2).flatten(2)


def scaled_scores(
    queries: Float[Tensor, "batch heads queries head_dim"],
    keys: Float[Tensor, "batch heads keys head_dim"],
) -> Float[Tensor, "batch heads queries keys"]:
    """QKᵀ/√d, the argument of the softmax in eq. (4)."""
    return (queries / math.sqrt(queries.shape[-1])) @ keys.transpose(-1, -2)


class MultiHeadAttention(nn.Module):
    """Multi-head attention, softmax(QKᵀ/√d)V (eq. 4), with a mask for padded keys."""

    def __init__(self, width: int, num_heads: int) -> None:
        """Make the projections.

        Args:
            width: Channels of queries, keys, values and output.
            num_heads: Heads; divides the width.
        """
        super().__init__()
        self.num_heads = num_heads
        self.query = nn.Linear(width, width)
        # A bias on the keys shifts all scores of a query alike, which the softmax cancels.
        self.key = nn.Linear(width, width, bias=False)
        self.value = nn.Linear(width, width)
        self.out = nn.Linear(width, width)

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
        q = split_heads(self.query(queries), self.num_heads)
        k = split_heads(self.key(keys), self.num_heads)
        scores = scaled_scores(q, k)
        return masked_softmax(scores if bias is None else scores + bias, key_mask[:, None, None])

    def gather(
        self,
        weights: Float[Tensor, "batch heads queries keys"],
        values: Float[Tensor, "batch keys width"],
    ) -> Float[Tensor, "batch queries width"]:
        """Let every query gather values.

        Args:
            weights: From `weights`.
            values: What is gathered.

        Returns:
            One row for each query; zeros plus the output bias where no key is valid.
        """
        v = split_heads(self.value(values), self.num_heads)
        return self.out(merge_heads(weights @ v))
