"""The geometric prior of a place, and the choice of a few well-spread ones."""

import numpy as np

from sr_mj.candidates.place_config import PlaceConfig
from sr_mj.candidates.place_fit import Fits
from sr_mj.candidates.ranking import best_per_group
from sr_mj.candidates.surface import voxel_keys

_FULL_CLEARANCE_M, _FULL_BALANCE_M = 0.02, 0.012
_FALL_SCALE_M = 0.05
# Two poses at one place count as different if their headings differ by a quarter turn.
_QUARTER_RAD = np.pi / 2 - 0.01
# All pairs are compared; on an empty table there would be tens of millions.
_MOST_COMPARED = 500


def inside_prior(fits: Fits, off_center: np.ndarray) -> np.ndarray:
    """Rate places on and in things.

    Args:
        fits: H fits.
        off_center: (H,) distance from the reference's centre over half the core's width.

    Returns:
        (H,) float32 in 0..1: well inside what carries it, in the middle, over much of its
        outline, and let go from low.
    """
    prior = 0.3 + 0.7 * (fits.balance_m / _FULL_BALANCE_M).clip(0, 1)
    prior *= np.exp(-(off_center**2) / 2)
    prior *= 0.6 + 0.4 * fits.contact
    prior *= np.exp(-fits.fall_m / _FALL_SCALE_M)
    return prior.astype(np.float32)


def beside_prior(fits: Fits, distance_m: np.ndarray, config: PlaceConfig) -> np.ndarray:
    """Rate places on the table.

    Args:
        fits: H fits.
        distance_m: (..., H) distance of the centre from the edge of the reference.
        config: Settings.

    Returns:
        (..., H) float32 in 0..1: far from everything, in the middle of the ring.
    """
    near, far = config.ring_m
    prior = 0.4 + 0.6 * ((fits.clearance_m - config.clearance_m) / _FULL_CLEARANCE_M).clip(0, 1)
    prior = prior * np.exp(-(fits.fall_m - config.release_gap_m) / _FALL_SCALE_M)
    off_middle = (distance_m - (near + far) / 2) / (far - near)
    return (prior * np.exp(-2 * off_middle**2)).astype(np.float32)


def choose_spread(
    xy: np.ndarray, yaw: np.ndarray, prior: np.ndarray, spread_m: float, limit: int
) -> np.ndarray:
    """Choose good places that are apart, or headings at one place that differ.

    Args:
        xy: (H, 2) places, metres.
        yaw: (H,) headings, radians.
        prior: (H,) ratings; what has none is not chosen.
        spread_m: Least distance between two choices of similar heading.
        limit: Most choices.

    Returns:
        Indices, best first; different places come before further headings.
    """
    rows = np.flatnonzero(prior > 0)
    cells = voxel_keys(xy[rows], spread_m)
    rows = rows[best_per_group(prior[rows], cells, _MOST_COMPARED)]
    order = rows[np.argsort(-prior[rows], kind="stable")]
    close = ((xy[order, None] - xy[order]) ** 2).sum(axis=-1) < spread_m**2
    first = _local_best(close)
    turn = np.abs((yaw[order, None] - yaw[order] + np.pi) % (2 * np.pi) - np.pi)
    kept = _local_best(close & ((turn < _QUARTER_RAD) | ~np.isin(np.arange(len(order)), first)))
    kept = kept[~np.isin(kept, first)]
    return order[np.concatenate([first, kept])[:limit]]


def _local_best(close: np.ndarray) -> np.ndarray:
    """Greedy suppression in rounds: indices of those that no better kept one is close to."""
    better = np.tril(close, k=-1)
    kept = np.zeros(len(close), bool)
    open_ = np.ones(len(close), bool)
    while open_.any():
        winners = open_ & ~(better & open_).any(axis=1)
        kept |= winners
        open_ &= ~winners & ~(better & winners).any(axis=1)
    return np.flatnonzero(kept)
