"""Morton order: a line through the points that keeps neighbours close."""

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

# 16 bits an axis resolve 7 µm of a 0.45 m workspace, so that two points share a code only when
# they are the same point; three axes fill 48 of the 63 bits.
_BITS = 16
# Steps that put two zero bits between the bits of a 16-bit number (shift, mask after the shift).
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def morton_codes(positions: Float[Tensor, "*batch 3"]) -> Int[Tensor, "*batch"]:
    """Interleave the bits of quantised coordinates.

    Args:
        positions: Positions normalised to [-1, 1]; what lies outside is clamped.

    Returns:
        Integer codes; x holds the lowest bit of each triple.
    """
    top = (1 << _BITS) - 1
    cells = ((positions.double().clamp(-1, 1) + 1) / 2 * top).round().long()
    for shift, mask in _SPREAD:
        cells = (cells | (cells << shift)) & mask
    x, y, z = cells.unbind(-1)
    return x | (y << 1) | (z << 2)


def morton_order(
    positions: Float[Tensor, "batch points 3"], mask: Bool[Tensor, "batch points"]
) -> Int[Tensor, "batch points"]:
    """Sort each cloud along the Morton curve, padding last.

    Args:
        positions: Positions normalised to [-1, 1].
        mask: True for real points.

    Returns:
        Indices that sort the points.
    """
    codes = morton_codes(positions).masked_fill(~mask, torch.iinfo(torch.int64).max)
    return codes.argsort(dim=-1, stable=True)
