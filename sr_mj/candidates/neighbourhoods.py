"""Points around seeds, packed into rectangular arrays for batched work."""

from dataclasses import dataclass

import numpy as np
import torch

# Coordinates of unused places: outside every strip and box.
_FAR_M = 9.0
_SEEDS_A_CHUNK = 64


@dataclass(frozen=True, kw_only=True)
class Neighbourhoods:
    """Neighbours of S seeds.

    Attributes:
        index: (S, M) int64 indices of the neighbours; -1 where a place is unused.
        offsets: (S, M, 3) float32 positions relative to the seed, metres; 9 m where unused.
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
        limit = radius_m**2 - (part**2).sum(dim=1)
        left = torch.addmm(squared_norm[None], part, cloud.T, alpha=-2)
        pairs.append(torch.nonzero(left < limit[:, None]) + torch.tensor([start, 0]))
    seed, point = torch.cat(pairs).numpy().T
    count = np.bincount(seed, minlength=len(seeds))
    place = np.arange(len(seed)) - np.repeat(np.cumsum(count) - count, count)
    index = np.full((len(seeds), count.max(initial=0)), -1)
    index[seed, place] = point
    offsets = np.full((*index.shape, 3), _FAR_M, np.float32)
    offsets[seed, place] = points[point] - seeds[seed]
    return Neighbourhoods(index=index, offsets=offsets, count=count)
