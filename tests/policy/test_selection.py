from typing import Any

import numpy as np
import pytest

from policy.network.selection import select_points

METHODS = ("balanced", "covering", "similar")


@pytest.mark.parametrize("method", METHODS)
def test_small_clouds_are_kept_whole(rng: np.random.Generator, method: Any) -> None:
    chosen = select_points(rng.normal(size=(8, 3)), rng.normal(size=8), max_points=8, method=method)
    assert chosen.tolist() == list(range(8))


@pytest.mark.parametrize("method", METHODS)
def test_choice_does_not_depend_on_order(rng: np.random.Generator, method: Any) -> None:
    points = rng.uniform(size=(300, 3)).astype(np.float32)
    similarity = rng.integers(0, 4, 300).astype(np.float32)  # many ties
    shuffle = rng.permutation(300)
    chosen = select_points(points, similarity, max_points=50, method=method)
    again = select_points(points[shuffle], similarity[shuffle], max_points=50, method=method)
    assert len(set(chosen.tolist())) == 50
    assert set(chosen.tolist()) == set(shuffle[again].tolist())


def test_similar_takes_the_top(rng: np.random.Generator) -> None:
    similarity = rng.normal(size=100)
    chosen = select_points(rng.normal(size=(100, 3)), similarity, max_points=20, method="similar")
    assert set(chosen.tolist()) == set(np.argsort(similarity)[-20:].tolist())


def test_balanced_takes_the_top_and_covers_the_rest(rng: np.random.Generator) -> None:
    points = rng.uniform(size=(2000, 3)) * [1, 1, 0]
    similarity = -np.linalg.norm(points, axis=1)
    chosen = select_points(points, similarity, max_points=100, method="balanced")
    assert set(np.argsort(similarity)[-50:].tolist()) == set(chosen[:50].tolist())
    gaps = np.linalg.norm(points[:, None] - points[None, chosen], axis=-1).min(axis=1)
    # Fifty discs that cover most of a unit square have a radius of about 0.1.
    assert gaps.max() < 0.16


def test_covering_shows_the_whole_of_what_is_similar(rng: np.random.Generator) -> None:
    """A disc that fits better on one side is covered from edge to edge."""
    points = rng.uniform(-1, 1, size=(2000, 3)) * [1, 1, 0]
    is_disc = np.linalg.norm(points, axis=1) < 0.3
    assert 120 < is_disc.sum() < 160
    similarity = np.where(is_disc, 1 + points[:, 0], 0.0)
    middles, gaps = {}, {}
    for method in METHODS[:2]:
        chosen = select_points(points, similarity, max_points=100, method=method)
        assert len(set(chosen.tolist())) == 100
        shown = points[chosen[:50]]
        middles[method] = np.abs(shown[is_disc[chosen[:50]]].mean(axis=0)).max()
        distance = np.linalg.norm(points[is_disc][:, None] - shown[None], axis=-1)
        gaps[method] = distance.min(axis=1).max()
    assert middles["covering"] < 0.05 < 0.1 < middles["balanced"]
    assert gaps["covering"] < 0.12 < 0.25 < gaps["balanced"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("max_points", [1, 6])
def test_duplicates_are_taken_once_each(method: Any, max_points: int) -> None:
    chosen = select_points(np.zeros((10, 3)), np.zeros(10), max_points=max_points, method=method)
    assert len(set(chosen.tolist())) == max_points
