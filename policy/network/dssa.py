"""Dense-sparse self-attention over the points (section 3.3.2)."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from policy.network.attention import masked_softmax, merge_heads, scaled_scores, split_heads
from policy.network.bias import RelativePositionBias
from policy.network.config import Sparsifier


def dense_weights(
    scores: Float[Tensor, "batch heads points points"],
    bias: Float[Tensor, "batch heads points points"],
    conv: nn.Module,
    mask: Bool[Tensor, "batch points"],
) -> Float[Tensor, "batch heads points points"]:
    """Attention of the dense convolutional branch.

    Args:
        scores: QKᵀ/√d with the points in Morton order.
        bias: Relative position bias B.
        conv: Convolution over the score map.
        mask: True for real points.

    Returns:
        Weights whose rows sum to 1 over the real points.
    """
    # Padding must look like the zeros that the convolution sees beyond the map's edge.
    is_pair = mask[:, None, :, None] & mask[:, None, None, :]
    padded = scores * is_pair
    # A depthwise convolution of so few channels is about ten times faster with them innermost.
    convolved = conv(padded.contiguous(memory_format=torch.channels_last)).contiguous()
    return masked_softmax(convolved + bias, mask[:, None, None])  # eq. (9)


def sparse_weights(
    scores: Float[Tensor, "batch heads points points"],
    bias: Float[Tensor, "batch heads points points"],
    mask: Bool[Tensor, "batch points"],
    sparsifier: Sparsifier,
) -> Float[Tensor, "batch heads points points"]:
    """Attention of the sparse branch.

    Args:
        scores: QKᵀ/√d.
        bias: Relative position bias B.
        mask: True for real points.
        sparsifier: "relu2" (eq. 10), or one of table 4's other two.

    Returns:
        Weights; those of padding are 0.
    """
    biased = scores + bias
    if sparsifier == "softmax":
        return masked_softmax(biased, mask[:, None, None])
    weights = biased.relu()
    if sparsifier == "relu2":
        weights = weights.square()  # eq. (10)
    # Departure from eq. (10): divided by the number of points. Without a normalisation the sum
    # over the points grows with their number, which varies from scene to scene.
    num_points = mask.sum(dim=-1, keepdim=True).clamp(min=1)
    return weights * (mask / num_points)[:, None, None]


class DSSALayer(nn.Module):
    """One layer of dense-sparse self-attention with residual and layer norm."""

    def __init__(self, width: int, num_heads: int, num_scales: int, sparsifier: Sparsifier) -> None:
        """Make the layer; at the start its dense branch is plain softmax attention.

        Args:
            width: Channels of the points.
            num_heads: Heads; divides the width.
            num_scales: Radial functions of the position bias.
            sparsifier: Activation of the sparse branch.
        """
        super().__init__()
        self.num_heads = num_heads
        self.sparsifier: Sparsifier = sparsifier
        self.query = nn.Linear(width, width)
        self.key = nn.Linear(width, width)
        self.value = nn.Linear(width, width)
        self.out = nn.Linear(width, width)
        self.norm = nn.LayerNorm(width)
        self.bias = RelativePositionBias(num_heads, num_scales)
        # Depthwise: heads are fused by the output projection only, as the text below eq. (8) says.
        # Without a bias of its own, which the softmax would cancel.
        self.conv = nn.Conv2d(num_heads, num_heads, 3, padding=1, groups=num_heads, bias=False)
        nn.init.dirac_(self.conv.weight, groups=num_heads)
        self.beta = nn.Parameter(torch.zeros(2))

    @property
    def alpha(self) -> Float[Tensor, "2"]:
        """Weights of the sparse and the dense branch; they sum to 1 and start equal."""
        return self.beta.softmax(dim=0)  # eq. (12)

    def forward(
        self,
        x: Float[Tensor, "batch points width"],
        basis: Float[Tensor, "batch basis points points"],
        mask: Bool[Tensor, "batch points"],
    ) -> Float[Tensor, "batch points width"]:
        """Let the points exchange information.

        Args:
            x: Point features in Morton order.
            basis: Position basis of the same points in the same order.
            mask: True for real points.

        Returns:
            Point features.
        """
        q = split_heads(self.query(x), self.num_heads)  # eq. (7)
        k = split_heads(self.key(x), self.num_heads)
        v = split_heads(self.value(x), self.num_heads)
        scores, bias = scaled_scores(q, k), self.bias(basis)  # eq. (8)
        sparse, dense = self.alpha
        weights = sparse * sparse_weights(scores, bias, mask, self.sparsifier)
        weights = weights + dense * dense_weights(scores, bias, self.conv, mask)
        return self.norm(x + self.out(merge_heads(weights @ v)))  # eq. (11)
