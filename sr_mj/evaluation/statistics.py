"""Intervals: of a success rate, and of the difference between two policies."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

Z_95 = 1.959963984540054
"""Quantile of the standard normal distribution that leaves 2.5 % above it."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate and how far it can be trusted.

    Attributes:
        value: The estimate.
        low: Lower end of the interval.
        high: Upper end of the interval.
    """

    value: float
    low: float
    high: float


def wilson(successes: int, runs: int, z: float = Z_95) -> Interval:
    """Estimate a success rate by the Wilson score interval.

    Args:
        successes: How many runs succeeded.
        runs: How many there were; with none, nothing is known.
        z: Quantile of the normal distribution; 95 % by default.

    Returns:
        Rate and interval, 0 to 1.

    Raises:
        ValueError: If there are more successes than runs.
    """
    if not 0 <= successes <= runs:
        raise ValueError(f"Got {successes} successes of {runs} runs; expected 0 to {runs}.")
    if runs == 0:
        return Interval(value=float("nan"), low=0.0, high=1.0)
    rate, spread = successes / runs, z**2 / runs
    center = (rate + spread / 2) / (1 + spread)
    half = z * np.sqrt(rate * (1 - rate) / runs + spread / (4 * runs)) / (1 + spread)
    # Rounding alone could leave the ends a hair outside of what they bound.
    low = 0.0 if successes == 0 else float(center - half)
    high = 1.0 if successes == runs else float(center + half)
    return Interval(value=rate, low=low, high=high)


def paired_bootstrap(
    groups: Sequence[Sequence[float]],
    rng: np.random.Generator,
    *,
    are_groups_drawn: bool = False,
    num_draws: int = 10_000,
    level: float = 0.95,
) -> Interval:
    """Estimate the mean of paired differences by the percentile bootstrap.

    Args:
        groups: Differences of pairs (same scene, same seed), one group for each scene.
        rng: Source of the draws.
        are_groups_drawn: Draw scenes with replacement, and pairs within each, anew for every time
            that a scene is drawn: what the difference would be on other scenes. With two or three
            scenes the interval is too narrow to be trusted. Otherwise the scenes are given and only
            pairs within each are drawn: what it would be with other seeds.
        num_draws: Bootstrap samples.
        level: Share of them inside the interval.

    Returns:
        Mean over all pairs, and its interval.

    Raises:
        ValueError: If there is no pair, or if scenes are to be drawn from fewer than two.
    """
    kept = [np.asarray(group, float) for group in groups if len(group)]
    if not kept:
        raise ValueError("Got no pairs to compare; expected at least one.")
    if are_groups_drawn and len(kept) < 2:
        raise ValueError("Got one scene to draw scenes from; expected at least two.")
    means = (_means_elsewhere if are_groups_drawn else _means_here)(kept, rng, num_draws)
    low, high = np.quantile(means, [(1 - level) / 2, (1 + level) / 2])
    value = float(np.concatenate(kept).mean())
    return Interval(value=value, low=float(low), high=float(high))


def _means_here(groups: list[np.ndarray], rng: np.random.Generator, num_draws: int) -> np.ndarray:
    """Draw pairs in given groups; return the means (num_draws,)."""
    totals = np.sum([_resampled_totals(group, rng, num_draws) for group in groups], axis=0)
    return totals / sum(map(len, groups))


def _means_elsewhere(
    groups: list[np.ndarray], rng: np.random.Generator, num_draws: int
) -> np.ndarray:
    """Draw groups, and pairs in each; return the means (num_draws,)."""
    drawn = rng.integers(len(groups), size=(num_draws, len(groups)))
    totals = np.empty(drawn.shape)
    for index, group in enumerate(groups):
        # A group that is drawn twice stands for two others, whose pairs are not the same.
        is_drawn = drawn == index
        totals[is_drawn] = _resampled_totals(group, rng, int(is_drawn.sum()))
    sizes = np.array([len(group) for group in groups])
    return totals.sum(axis=1) / sizes[drawn].sum(axis=1)


def _resampled_totals(group: np.ndarray, rng: np.random.Generator, num_draws: int) -> np.ndarray:
    """Draw a group again and again with replacement; return the sums (num_draws,)."""
    return group[rng.integers(len(group), size=(num_draws, len(group)))].sum(axis=1)
