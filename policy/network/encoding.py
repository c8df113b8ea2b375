"""Fourier features of positions, and the multilayer perceptron used throughout."""

import itertools
import math

import torch
from jaxtyping import Float
from torch import Tensor, nn


def fourier_features(
    positions: Float[Tensor, "*batch 3"], num_bands: int
) -> Float[Tensor, "*batch channels"]:
    """Sines and cosines of a position at octaves of half a wave across the workspace.

    Args:
        positions: Positions normalised to [-1, 1].
        num_bands: Octaves; the wavelengths are 4, 2, 1, ... in normalised units.

    Returns:
        The position itself, then sines, then cosines: 3 + 6 num_bands channels.
    """
    bands = torch.arange(num_bands, dtype=positions.dtype, device=positions.device)
    angles = (positions[..., None] * (math.pi / 2 * 2.0**bands)).flatten(-2)
    return torch.cat([positions, angles.sin(), angles.cos()], dim=-1)


def num_fourier_features(num_bands: int) -> int:
    """Channels that `fourier_features` returns."""
    return 3 + 6 * num_bands


def mlp(*widths: int) -> nn.Sequential:
    """Linear layers of the given widths with GELU between them.

    Args:
        *widths: Input width, hidden widths, output width.

    Returns:
        The layers, len(widths) - 1 of them linear.
    """
    layers: list[nn.Module] = []
    for num_in, num_out in itertools.pairwise(widths):
        layers += [nn.Linear(num_in, num_out), nn.GELU()]
    return nn.Sequential(*layers[:-1])
