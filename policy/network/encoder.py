"""Encoder layers over the candidates, behind stage 2."""

from jaxtyping import Bool, Float
from torch import Tensor, nn

from policy.network.attention import MultiHeadAttention
from policy.network.config import SelfAttention
from policy.network.encoding import mlp


class DiagonalSelfAttention(nn.Module):
    """Self-attention under a diagonal mask.

    The softmax over a single entry is 1, whatever the query and the key: what remains are the
    value and the output projection. Query and key would be dead weight, so there are none.
    """

    def __init__(self, width: int) -> None:
        """Make the two projections.

        Args:
            width: Channels of a state.
        """
        super().__init__()
        self.value = nn.Linear(width, width)
        self.out = nn.Linear(width, width)

    def forward(
        self,
        states: Float[Tensor, "batch candidates width"],
        mask: Bool[Tensor, "batch candidates"],
    ) -> Float[Tensor, "batch candidates width"]:
        """Map each state by itself; the mask changes nothing."""
        del mask
        return self.out(self.value(states))


class FullSelfAttention(nn.Module):
    """Self-attention in which a candidate sees every other one."""

    def __init__(self, width: int, num_heads: int) -> None:
        """Make the attention.

        Args:
            width: Channels of a state.
            num_heads: Heads; divides the width.
        """
        super().__init__()
        self.attention = MultiHeadAttention(width, num_heads)

    def forward(
        self,
        states: Float[Tensor, "batch candidates width"],
        mask: Bool[Tensor, "batch candidates"],
    ) -> Float[Tensor, "batch candidates width"]:
        """Let the real candidates exchange information."""
        weights = self.attention.weights(states, states, mask)
        return self.attention.gather(weights, states)


class EncoderLayer(nn.Module):
    """Self-attention and feed-forward network, each with a residual and a layer norm."""

    def __init__(self, width: int, num_heads: int, self_attention: SelfAttention) -> None:
        """Make the layer.

        Args:
            width: Channels of a state.
            num_heads: Heads; divides the width.
            self_attention: "diagonal" keeps the evaluation of candidates independent, as section
                3.3.1 asks; "full" is the usual encoder that the same section also describes.
        """
        super().__init__()
        if self_attention == "diagonal":
            self.attention = DiagonalSelfAttention(width)
        else:
            self.attention = FullSelfAttention(width, num_heads)
        self.attention_norm = nn.LayerNorm(width)
        self.feed_forward = mlp(width, 4 * width, width)
        self.feed_forward_norm = nn.LayerNorm(width)

    def forward(
        self,
        states: Float[Tensor, "batch candidates width"],
        mask: Bool[Tensor, "batch candidates"],
    ) -> Float[Tensor, "batch candidates width"]:
        """Refine the states.

        Args:
            states: One state a candidate.
            mask: True for real candidates.

        Returns:
            Refined states.
        """
        states = self.attention_norm(states + self.attention(states, mask))
        return self.feed_forward_norm(states + self.feed_forward(states))
