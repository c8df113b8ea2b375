import itertools

import numpy as np
import pytest

from sr_mj.planning.config import SearchConfig
from sr_mj.planning.search import search_path, shorten

START, GOAL = np.zeros(6), np.array([1.5, 0, 0, 0, 0, 0.0])


def around_a_wall(a, b):
    """A wall across the first two joints, open beyond 0.5 rad of the second."""
    points = a + np.linspace(0, 1, 40)[:, None] * (b - a)
    return not np.any((np.abs(points[:, 0] - 0.75) < 0.1) & (points[:, 1] < 0.5))


def test_finds_a_free_way_around():
    path = search_path(START, GOAL, around_a_wall, SearchConfig(max_samples=500))
    np.testing.assert_array_equal(path[0], START)
    np.testing.assert_array_equal(path[-1], GOAL)
    assert all(around_a_wall(a, b) for a, b in itertools.pairwise(path))
    assert path[:, 1].max() >= 0.5


def test_same_seed_same_path_and_another_seed_another():
    first, second, other = (
        search_path(START, GOAL, around_a_wall, SearchConfig(max_samples=500, seed=seed))
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, second)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_gives_up():
    def wall(a, b):
        return (a[0] < 0.75) == (b[0] < 0.75)

    assert search_path(START, GOAL, wall, SearchConfig(max_samples=60)) is None


@pytest.mark.parametrize("seed", range(4))
def test_shortening_keeps_the_ends_and_never_lengthens(seed):
    rng = np.random.default_rng(seed)
    path = np.concatenate([[START], rng.uniform(-1, 2, (6, 6)), [GOAL]])
    short = shorten(path, lambda a, b: True, SearchConfig(), rng)
    np.testing.assert_array_equal(short[[0, -1]], [START, GOAL])

    def length(p):
        return np.linalg.norm(np.diff(p, axis=0), axis=1).sum()

    assert np.linalg.norm(GOAL - START) <= length(short) <= length(path)
    np.testing.assert_array_equal(shorten(path, lambda a, b: False, SearchConfig(), rng), path)
