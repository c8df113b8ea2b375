import numpy as np
import pytest

from policy.similar_region import SmoothedSimilarity, neighbour_pairs

RADIUS_M = 0.02


def smoothed(x_m, similarity, confidence=None, **options) -> SmoothedSimilarity:
    """Smooth a similarity over points on a line."""
    points = np.zeros((len(x_m), 3))
    points[:, 0] = x_m
    confidence = np.ones(len(x_m)) if confidence is None else np.asarray(confidence)
    return SmoothedSimilarity(points, np.asarray(similarity), confidence, RADIUS_M, **options)


def test_neighbours_are_averaged_by_distance_and_confidence() -> None:
    # Half the radius apart: the neighbour weighs exp(-2 / 4). The third is out of reach.
    found = smoothed([0.0, 0.01, 0.05], [1.0, 0.0, 0.7], [1.0, 3.0, 0.0])
    near = np.exp(-0.5)
    expected = [1 / (1 + 3 * near), near / (3 + near), 0.7]
    np.testing.assert_allclose(found.values, expected, rtol=1e-5)
    assert found.background == pytest.approx(sorted(expected)[1], rel=1e-5)


def test_pairs_may_be_known() -> None:
    x_m, similarity = np.arange(9) * 0.008, np.linspace(0, 1, 9) ** 2
    points = np.stack([x_m, 0 * x_m, 0 * x_m], axis=1)
    pairs = neighbour_pairs(points, RADIUS_M)
    assert {tuple(sorted(pair)) for pair in pairs.tolist()} == {
        (i, j) for i in range(9) for j in range(i + 1, 9) if j - i <= 2
    }
    known, found = smoothed(x_m, similarity, pairs=pairs), smoothed(x_m, similarity)
    assert np.array_equal(known.values, found.values)


def test_the_best_region_is_the_one_with_the_most_in_total() -> None:
    """Not the one with the best point, and not all points that reach the level."""
    x_m = np.concatenate([np.arange(40) * 0.01, 1 + np.arange(5) * 0.01, [2.0]])
    similarity = np.concatenate([np.zeros(40), np.full(5, 0.8), [1.0]])
    found = smoothed(x_m, similarity)
    assert found.values.argmax() == 45 and found.background == 0
    assert found.best_region(0.5).tolist() == [40, 41, 42, 43, 44]


def test_a_region_grows_as_far_as_points_are_connected() -> None:
    x_m = np.concatenate([np.arange(40) * 0.1, 10 + np.arange(6) * 0.015, [20.0]])
    similarity = np.concatenate([np.zeros(40), [0.5, 0.5, 1.0, 1.0, 0.5, 0.1], [0.6]])
    found = smoothed(x_m, similarity)
    region = found.best_region(0.8)
    assert region.tolist() == [42, 43]
    # Beyond it lie fainter points that touch it, one that is too faint, and one that is apart.
    assert found.grow(region, 0.4).tolist() == [40, 41, 42, 43, 44]
