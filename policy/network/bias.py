"""The learnable relative position bias B of eq. (8) to (10)."""

import torch
from jaxtyping import Float
from torch import Tensor, nn

# Normalised units: 0.02 is about a point spacing (5 mm in the standard workspace), 1 half of the
# workspace. Log-spaced between them, since a centimetre matters near a point and not far away.
_SHORTEST, _LONGEST = 0.02, 1.0


def position_basis(
    positions: Float[Tensor, "batch points 3"], num_scales: int
) -> Float[Tensor, "batch basis points points"]:
    """Functions of the coordinate difference that a bias is a mixture of.

    They depend on positions alone, so that one evaluation serves every head and layer, and memory
    is (3 + num_scales) numbers a pair instead of a hidden layer a pair.

    Args:
        positions: Positions x normalised to [-1, 1].
        num_scales: Number of radial functions.

    Returns:
        First the radial ones, 1 / (1 + |Δ|²/s²) with log-spaced scales s; then for each axis
        sign(Δ) log(1 + |Δ|/0.02), scaled to reach 1 at |Δ| = 2, the width of the workspace.
        Δ = x_j - x_i for row i and column j.
    """
    scales = torch.logspace(
        torch.tensor(_SHORTEST).log10().item(),
        torch.tensor(_LONGEST).log10().item(),
        num_scales,
        dtype=positions.dtype,
        device=positions.device,
    )
    delta = positions[:, None] - positions[:, :, None]
    squared = delta.square().sum(dim=-1)
    # Not a Gaussian: its tails underflow, which makes exp ten times slower on a CPU.
    radial = (1 + squared[:, None] / scales.square()[:, None, None]).reciprocal()
    reach = torch.log1p(torch.tensor(2 / _SHORTEST, dtype=positions.dtype))
    signed = delta.sign() * (delta.abs() / _SHORTEST).log1p() / reach
    return torch.cat([radial, signed.permute(0, 3, 1, 2)], dim=1)


class RelativePositionBias(nn.Module):
    """B of eq. (8): for every head, a learnt mixture of the position basis."""

    def __init__(self, num_heads: int, num_scales: int) -> None:
        """Make the weights; they start at zero, so that attention starts without a bias.

        Args:
            num_heads: Heads.
            num_scales: Radial functions in the basis.
        """
        super().__init__()
        self.weight = nn.Parameter(torch.zeros(num_heads, num_scales + 3))

    def forward(
        self, basis: Float[Tensor, "batch basis points points"]
    ) -> Float[Tensor, "batch heads points points"]:
        """Mix the basis.

        Args:
            basis: From `position_basis`.

        Returns:
            The bias added to the scores.
        """
        batch, _, rows, cols = basis.shape
        return (self.weight @ basis.flatten(2)).view(batch, -1, rows, cols)
