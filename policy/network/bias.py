"""Learnable relative position biases: B of eq. (8) to (10), and its counterpart for candidates."""

import math

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from policy.network.mixing import MixingModule

# Normalised units: 0.02 is about a point spacing (5 mm in the standard workspace), 1 half of the
# workspace. Log-spaced between them, since a centimetre matters near a point and not far away.
_SHORTEST, _LONGEST = 0.02, 1.0
# Scales that the local heads of stage 2 start with: about 2 and 4 cm in the standard workspace,
# half the width of a small object and of a large one.
_LOCAL_SCALES = (0.1, 0.2)
# Bias at distance 0 that they start with. e^8 lets the ten points of a fingertip outweigh the
# five hundred of a cloud.
_LOCAL_STRENGTH = 8.0
_NUM_TOOL_FUNCTIONS = 4
# Distance at which the directed functions reach half of their range: 2 cm.
_NEAR = 0.1


def bias_scales(num_scales: int) -> list[float]:
    """Log-spaced scales of the radial functions, in normalised units."""
    low, high = math.log(_SHORTEST), math.log(_LONGEST)
    steps = max(num_scales - 1, 1)
    return [math.exp(low + (high - low) * i / steps) for i in range(num_scales)]


def nearest_scale(num_scales: int, wanted: float) -> int:
    """Index of the radial function whose scale is nearest to a wanted one, by ratio.

    Args:
        num_scales: Number of radial functions.
        wanted: Scale, normalised units.

    Returns:
        The index.
    """
    off = [abs(math.log(scale / wanted)) for scale in bias_scales(num_scales)]
    return off.index(min(off))


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
        Δ / (0.1 + |Δ|). Δ = x_j - x_i for row i and column j.
    """
    columns = positions.transpose(1, 2)
    delta = columns[:, :, None] - columns[..., None]
    return torch.cat([_radial(delta.square().sum(dim=1), num_scales), _signed(delta)], dim=1)


def candidate_basis(
    poses: Float[Tensor, "batch candidates 7"],
    positions: Float[Tensor, "batch points 3"],
    is_place: Tensor,
    num_scales: int,
) -> Float[Tensor, "batch basis candidates points"]:
    """Functions of where a point lies relative to a candidate.

    Args:
        poses: Normalised position, quaternion x, y, z, w.
        positions: Normalised positions of the points.
        is_place: (batch,) bool.
        num_scales: Number of radial functions.

    Returns:
        First radial functions as in `position_basis`: for picking of the distance, for placing of
        the distance on the ground plan, since the tool's height over a place depends on what it
        holds. Then |Δ| / (0.1 + |Δ|) for the tool's three axes, and with its sign along the
        approach; those do not change if the gripper makes a half turn, which grasps alike.
    """
    delta = positions[:, None] - poses[:, :, None, :3]
    weight = torch.ones(3, dtype=delta.dtype, device=delta.device).repeat(len(delta), 1)
    weight[:, 2] = (~is_place).to(delta.dtype)
    squared = (delta.square() * weight[:, None, None]).sum(dim=-1)
    in_tool = _signed((delta @ rotation_matrices(poses[..., 3:])).movedim(-1, 1))
    return torch.cat([_radial(squared, num_scales), in_tool.abs(), in_tool[:, 2:]], dim=1)


def rotation_matrices(quat_xyzw: Float[Tensor, "*batch 4"]) -> Float[Tensor, "*batch 3 3"]:
    """Turn unit quaternions x, y, z, w into matrices; zeros, as on padding, into the identity."""
    x, y, z, w = quat_xyzw.unbind(-1)
    rows = [
        *(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        *(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        *(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    ]
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def _radial(squared: Float[Tensor, "batch rows cols"], num_scales: int) -> Tensor:
    # Not a Gaussian: its tails underflow, which makes exp ten times slower on a CPU.
    scales = bias_scales(num_scales)
    return torch.stack([(squared / s**2).add_(1).reciprocal_() for s in scales], dim=1)


def _signed(delta: Float[Tensor, "batch axes rows cols"]) -> Tensor:
    # A direction that fades where the distance does. A logarithm would cost ten times as much.
    return delta / (delta.abs() + _NEAR)


class RelativePositionBias(MixingModule):
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
        # `@` of a matrix with a batch rearranges the batch first, which is ten times slower.
        weight = self.weight.expand(batch, -1, -1)
        return torch.bmm(weight, basis.flatten(2)).view(batch, -1, rows, cols)


class CandidateBias(MixingModule):
    """The bias of stage 2: for every phase and head, a learnt mixture of the candidate basis."""

    def __init__(self, num_phases: int, num_heads: int, num_scales: int) -> None:
        """Make the weights: the first half of the heads starts local, the others without a bias.

        Args:
            num_phases: Phases; each has weights of its own.
            num_heads: Heads.
            num_scales: Radial functions in the basis.
        """
        super().__init__()
        weight = torch.zeros(num_phases, num_heads, num_scales + _NUM_TOOL_FUNCTIONS)
        for head in range(num_heads // 2):
            wanted = _LOCAL_SCALES[head % len(_LOCAL_SCALES)]
            weight[:, head, nearest_scale(num_scales, wanted)] = _LOCAL_STRENGTH
        self.weight = nn.Parameter(weight)

    def forward(
        self, basis: Float[Tensor, "batch basis candidates points"], phase: Int[Tensor, " batch"]
    ) -> Float[Tensor, "batch heads candidates points"]:
        """Mix the basis.

        Args:
            basis: From `candidate_basis`.
            phase: Phase of every decision.

        Returns:
            The bias added to the scores.
        """
        rows, cols = basis.shape[2:]
        return (self.weight[phase] @ basis.flatten(2)).unflatten(-1, (rows, cols))
