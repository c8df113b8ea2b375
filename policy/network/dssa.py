"""Dense-sparse self-attention over the points (section 3.3.2)."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from policy.network.bias import RelativePositionBias
from policy.network.config import Sparsifier
from policy.network.mixing import MixingModule
from policy.network.projections import merge_heads, split_heads

# Score of padding: far below any other, yet finite in half precision.
_PADDING_SCORE = -3e4


def convolved_factors(
    queries: Float[Tensor, "batch heads points head_dim"],
    keys: Float[Tensor, "batch heads points head_dim"],
    kernel: Float[Tensor, "heads 1 3 3"],
) -> tuple[Tensor, Tensor]:
    """Factors whose product is Conv(QKᵀ), a depthwise 3 x 3 convolution of the score map.

    Scores are products of queries and keys, so that their convolution is a product too, of
    neighbouring queries with mixtures of neighbouring keys:
    Conv(S)_ij = Σ_a q_(i+a) · Σ_b w_ab k_(j+b). That replaces a convolution over N x N maps, the
    slowest step on a CPU, by a longer inner product. Beyond the map's edge are zeros.

    Args:
        queries: Queries, 0 on padding.
        keys: Keys, 0 on padding.
        kernel: Weights w of the convolution.

    Returns:
        Left and right factor, (batch, heads, points, 3 head_dim) each.
    """
    batch, _, points, head_dim = keys.shape
    left = torch.cat(_neighbours(queries), dim=-1)
    # One small product for each head: (heads, b, everything else).
    near = torch.stack(_neighbours(keys.transpose(0, 1)), dim=1).flatten(2)
    right = torch.bmm(kernel.squeeze(1), near).unflatten(-1, (batch, points, head_dim))
    return left, right.permute(2, 0, 3, 1, 4).flatten(-2)


def _neighbours(x: Float[Tensor, "batch heads points head_dim"]) -> list[Tensor]:
    """Rows i - 1, i and i + 1 for every i; zeros beyond the ends."""
    padded = nn.functional.pad(x, (0, 0, 1, 1))
    num = x.shape[2]
    return [padded[:, :, step : step + num] for step in range(3)]


def biased_product(
    left: Float[Tensor, "batch heads points channels"],
    right: Float[Tensor, "batch heads points channels"],
    bias: Float[Tensor, "batch heads points points"],
) -> Float[Tensor, "batch heads points points"]:
    """Left · rightᵀ + bias in one pass over the N x N map."""
    shape = bias.shape
    product = torch.baddbmm(
        bias.flatten(0, 1), left.flatten(0, 1), right.flatten(0, 1).transpose(1, 2)
    )
    return product.view(shape)


def sparsify(
    biased: Float[Tensor, "batch heads points points"], sparsifier: Sparsifier
) -> Float[Tensor, "batch heads points points"]:
    """Activation of the sparse branch, on S + B.

    Args:
        biased: Scores with their bias.
        sparsifier: "relu2" (eq. 10), or one of table 4's other two.

    Returns:
        Weights, not normalised unless by the softmax.
    """
    if sparsifier == "softmax":
        return biased.softmax(dim=-1)
    weights = biased.relu()
    return weights * weights if sparsifier == "relu2" else weights  # eq. (10)


class DSSALayer(MixingModule):
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
        is_real = mask[:, None, :, None].to(x.dtype)
        scale = 1 / math.sqrt(x.shape[-1] // self.num_heads)
        q = split_heads(self.query(x), self.num_heads) * (is_real * scale)  # eq. (7)
        k = split_heads(self.key(x), self.num_heads) * is_real
        v = split_heads(self.value(x), self.num_heads) * is_real
        bias = self.bias(basis)
        sparse, dense = self.alpha
        y = sparse * self._sparse(q, k, v, bias, mask) + dense * self._dense(q, k, v, bias, mask)
        return self.norm(x + self.out(merge_heads(y)))  # eq. (11)

    def _dense(self, q: Tensor, k: Tensor, v: Tensor, bias: Tensor, mask: Tensor) -> Tensor:
        """Softmax(Conv(QKᵀ/√d) + B) V, eq. (9)."""
        left, right = convolved_factors(q, k, self.conv.weight)
        left, right = _exclude_padding(left, right, mask)
        return biased_product(left, right, bias).softmax(dim=-1) @ v

    def _sparse(self, q: Tensor, k: Tensor, v: Tensor, bias: Tensor, mask: Tensor) -> Tensor:
        """ReLU²(QKᵀ/√d + B) V, eq. (8) and (10)."""
        if self.sparsifier == "softmax":
            q, k = _exclude_padding(q, k, mask)
            return sparsify(biased_product(q, k, bias), "softmax") @ v
        # Departure from eq. (10): divided by the number of points. Without a normalisation the sum
        # over the points grows with their number, which varies from scene to scene.
        num_points = mask.sum(dim=-1).clamp(min=1)[:, None, None, None]
        return sparsify(biased_product(q, k, bias), self.sparsifier) @ (v / num_points)


def _exclude_padding(left: Tensor, right: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
    """Add a channel to both factors that lowers the scores of padding in their product."""
    penalty = (~mask).to(right.dtype)[:, None, :, None] * _PADDING_SCORE
    penalty = penalty.expand(*right.shape[:3], 1)
    return torch.cat([left, torch.ones_like(penalty)], -1), torch.cat([right, penalty], -1)
