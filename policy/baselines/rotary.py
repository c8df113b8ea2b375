"""Attention whose scores depend on where a point lies relative to what asks for it."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from policy.network.attention import masked_softmax, scaled_scores
from policy.network.projections import ProjectedAttention

NUM_AXES = 3
# Wavelengths in units of half the workspace: from twice its width to 28 mm in the standard one, as
# the Fourier features of the SR network.
_LONGEST, _SHORTEST = 4.0, 0.125
# Score at the start of a point at the candidate over one elsewhere, in the heads that begin local:
# as in stage 2 of the SR network.
_LOCAL_STRENGTH = 8.0


def rotary_frequencies(head_dim: int) -> list[float]:
    """Log-spaced angular frequencies of one axis, radians a normalised unit.

    Args:
        head_dim: Channels of a head, at least 6; two of them turn at one frequency of one axis.

    Returns:
        head_dim // 6 frequencies; the channels that are left over do not turn.
    """
    num = head_dim // (2 * NUM_AXES)
    ratio = (_LONGEST / _SHORTEST) ** (1 / max(num - 1, 1))
    return [2 * math.pi / _LONGEST * ratio**i for i in range(num)]


def rotate(
    x: Float[Tensor, "batch heads items head_dim"], positions: Float[Tensor, "batch items 3"]
) -> Float[Tensor, "batch heads items head_dim"]:
    """Turn pairs of channels by angles proportional to the coordinates.

    The inner product of two rows turned in this way depends on the difference of their positions
    alone.

    Args:
        x: Queries or keys.
        positions: Normalised positions.

    Returns:
        The turned rows, of the same lengths.
    """
    frequencies = positions.new_tensor(rotary_frequencies(x.shape[-1]))
    angles = (positions[..., None] * frequencies).flatten(-2)[:, None]
    cos, sin, num = angles.cos(), angles.sin(), angles.shape[-1]
    first, second, rest = x[..., :num], x[..., num : 2 * num], x[..., 2 * num :]
    turned = [first * cos - second * sin, first * sin + second * cos]
    return torch.cat([part.to(x.dtype) for part in turned] + [rest], dim=-1)


class RotaryAttention(ProjectedAttention):
    """Multi-head cross-attention with rotary positions in space."""

    def __init__(self, width: int, num_heads: int, *, local_heads: bool) -> None:
        """Make the projections.

        Args:
            width: Channels of queries, keys, values and output.
            num_heads: Heads; divides the width.
            local_heads: Start half of the heads with equal biases of queries and keys. Their
                product, turned, is a sum of cosines of the distance, which is largest at 0.
        """
        super().__init__(width, num_heads, key_bias=True)
        head_dim = width // num_heads
        num_pairs = NUM_AXES * len(rotary_frequencies(head_dim))
        bias = torch.zeros(num_heads, head_dim)
        if local_heads:
            squared = _LOCAL_STRENGTH * math.sqrt(head_dim) / num_pairs
            bias[: num_heads // 2, :num_pairs] = math.sqrt(squared)
        with torch.no_grad():
            self.query.bias.copy_(bias.flatten())
            self.key.bias.copy_(bias.flatten())

    def weights(
        self,
        queries: Float[Tensor, "batch queries width"],
        query_positions: Float[Tensor, "batch queries 3"],
        keys: Float[Tensor, "batch keys width"],
        key_positions: Float[Tensor, "batch keys 3"],
        key_mask: Bool[Tensor, "batch keys"],
    ) -> Float[Tensor, "batch heads queries keys"]:
        """Attention of every query on the keys.

        Args:
            queries: What asks.
            query_positions: Where it is, normalised.
            keys: What is compared with the queries.
            key_positions: Where that is.
            key_mask: True for real keys, False for padding.

        Returns:
            Rows that sum to 1, or to 0 where no key is valid.
        """
        q, k = self.queries_and_keys(queries, keys)
        q, k = rotate(q, query_positions), rotate(k, key_positions)
        return masked_softmax(scaled_scores(q, k), key_mask[:, None, None])
