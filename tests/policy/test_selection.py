from typing import Any

import numpy as np
import pytest

from policy.network.selection import select_points


@pytest.mark.parametrize("method", ["balanced", "similar"])
def test_small_clouds_are_kept_whole(rng: np.random.Generator, method: Any) -> None:
    chosen = select_points(rng.normal(size=(8, 3)), rng.normal(size=8), max_points=8, method=method)
    assert chosen.tolist() == list(range(8))


@pytest.mark.parametrize("method", ["balanced", "similar"])
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


def test_duplicates_are_taken_once_each() -> None:
    chosen = select_points(np.zeros((10, 3)), np.zeros(10), max_points=6, method="balanced")
    assert len(set(chosen.tolist())) == 6
