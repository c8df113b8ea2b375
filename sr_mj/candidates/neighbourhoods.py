"""Points around seeds, packed into rectangular arrays for batched work."""

from dataclasses import dataclass

import numpy as np
import torch

# Coordinates of unused places: outside every strip and box.
_FAR_M = 9.0
# BLAS sums in an order that depends on where an array lies in memory. Multiples of 2^-13 m (0.12
# mm) below 2^-3 m, times multiples of 2^-11: a sum of three has 23 bits, which float32 holds. The
# products are exact in any order, and the same seed gives the same bytes.
_OFFSET_STEP_M, _AXIS_STEP = 2.0**-13, 2.0**-11
_SLACK_M = 1e-4
_SEEDS_A_CHUNK = 64


@dataclass(frozen=True, kw_only=True)
class Neighbourhoods:
    """Neighbours of S seeds.

    Attributes:
        index: (S, M) int64 indices of the neighbours; -1 where a place is unused.
        offsets: (S, M, 3) float32 positions relative to the seed, metres, rounded to multiples of
            2^-13 m; 9 m where unused.
        count: (S,) number of neighbours; they fill the first places.
    """

    index: np.ndarray
    offsets: np.ndarray
    count: np.ndarray


def gather_neighbours(points: np.ndarray, seeds: np.ndarray, radius_m: float) -> Neighbourhoods:
    """Collect the points within a radius of every seed.

    Args:
        points: (N, 3) float32 positions, metres.
        seeds: (S, 3) float32 positions.
        radius_m: Radius, metres.

    Returns:
        The neighbourhoods, as wide as the largest needs.
    """
    cloud, centers = torch.from_numpy(points), torch.from_numpy(seeds)
    squared_norm = (cloud**2).sum(dim=1)
    pairs = [torch.zeros((0, 2), dtype=torch.long)]
    for start in range(0, len(seeds), _SEEDS_A_CHUNK):
        part = centers[start : start + _SEEDS_A_CHUNK]
        # |p - s|^2 < r^2, with what depends on the seed alone moved to the right.
        limit = (radius_m + _SLACK_M) ** 2 - (part**2).sum(dim=1)
        left = torch.addmm(squared_norm[None], part, cloud.T, alpha=-2)
        pairs.append(torch.nonzero(left < limit[:, None]) + torch.tensor([start, 0]))
    seed, point = torch.cat(pairs).numpy().T
    steps = np.rint((points[point] - seeds[seed]) / _OFFSET_STEP_M)
    # The product above only preselects: its rounding must not decide.
    inside = np.square(steps).sum(axis=1) < (radius_m / _OFFSET_STEP_M) ** 2
    seed, point, steps = seed[inside], point[inside], steps[inside]
    count = np.bincount(seed, minlength=len(seeds))
    place = np.arange(len(seed)) - np.repeat(np.cumsum(count) - count, count)
    index = np.full((len(seeds), count.max(initial=0)), -1)
    index[seed, place] = point
    offsets = np.full((*index.shape, 3), _FAR_M, np.float32)
    offsets[seed, place] = steps * np.float32(_OFFSET_STEP_M)
    return Neighbourhoods(index=index, offsets=offsets, count=count)


def exact_axes(rotation: np.ndarray) -> torch.Tensor:
    """Round rotation matrices so that their products with `Neighbourhoods.offsets` are exact.

    Args:
        rotation: (..., 3, 3) rotations.

    Returns:
        (..., 3, 3) float32, within 2^-12 of the rotations: 20 micrometres at 75 mm.
    """
    return torch.from_numpy(np.rint(rotation / _AXIS_STEP).astype(np.float32)) * _AXIS_STEP
