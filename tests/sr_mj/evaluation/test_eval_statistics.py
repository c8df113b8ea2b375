import itertools

import numpy as np
import pytest

from sr_mj.evaluation.statistics import Interval, paired_bootstrap, wilson


@pytest.mark.parametrize(
    ("successes", "runs", "low", "high"),
    [
        # Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (20, 20, 0.8389, 1.0),
    ],
)
def test_wilson_has_the_published_values(successes, runs, low, high):
    interval = wilson(successes, runs)
    assert interval.value == successes / runs
    assert (round(interval.low, 4), round(interval.high, 4)) == (low, high)


def test_wilson_is_symmetric_and_narrows():
    for successes in range(11):
        a, b = wilson(successes, 10), wilson(10 - successes, 10)
        assert a.low == pytest.approx(1 - b.high) and a.high == pytest.approx(1 - b.low)
        assert a.low <= a.value <= a.high
        wide, narrow = wilson(successes, 10), wilson(successes * 100, 1000)
        assert narrow.high - narrow.low < wide.high - wide.low


def test_wilson_of_nothing_knows_nothing():
    interval = wilson(0, 0)
    assert np.isnan(interval.value) and (interval.low, interval.high) == (0.0, 1.0)


@pytest.mark.parametrize("successes", [-1, 4])
def test_wilson_refuses_impossible_counts(successes):
    with pytest.raises(ValueError) as error:
        wilson(successes, 3)
    assert str(error.value) == f"Got {successes} successes of 3 runs; expected 0 to 3."


def test_bootstrap_of_equal_differences_is_a_point():
    point = Interval(value=0.5, low=0.5, high=0.5)
    for are_drawn in (False, True):
        rng = np.random.default_rng(0)
        found = paired_bootstrap([[0.5] * 4, [0.5] * 3], rng, are_groups_drawn=are_drawn)
        assert found == point


def test_bootstrap_of_many_pairs_is_the_normal_interval():
    values = np.random.default_rng(1).normal(0.2, 1.0, 400)
    found = paired_bootstrap([values.tolist()], np.random.default_rng(2), num_draws=20_000)
    half = 1.96 * values.std() / np.sqrt(len(values))
    assert found.value == pytest.approx(values.mean())
    assert found.low == pytest.approx(values.mean() - half, abs=0.005)
    assert found.high == pytest.approx(values.mean() + half, abs=0.005)


def test_drawing_scenes_sees_what_drawing_pairs_cannot():
    # No scene differs from itself, but scenes differ from each other.
    groups = [[0.0] * 15, [0.0] * 15, [1.0] * 15, [1.0] * 15]
    given = paired_bootstrap(groups, np.random.default_rng(0))
    assert (given.low, given.high) == (0.5, 0.5)
    drawn = paired_bootstrap(groups, np.random.default_rng(0), are_groups_drawn=True)
    # Of four scenes, all four are of one kind with probability 1 / 16 each way.
    assert (drawn.low, drawn.high) == (0.0, 1.0)
    assert drawn.value == 0.5


def test_scenes_of_unequal_size_count_by_their_pairs():
    found = paired_bootstrap([[1.0] * 3, [0.0]], np.random.default_rng(0), are_groups_drawn=True)
    assert found.value == 0.75


def every_mean(groups, are_groups_drawn):
    """Every mean that can be drawn, with its probability: sorted means, cumulated shares."""
    means, shares = [], []
    choices = itertools.product(groups, repeat=len(groups)) if are_groups_drawn else [groups]
    choices = list(choices)
    for chosen in choices:
        # What is drawn anew for every group, also for one that was chosen twice.
        draws = [list(itertools.product(group, repeat=len(group))) for group in chosen]
        found = [sum(map(sum, pairs)) for pairs in itertools.product(*draws)]
        means += [total / sum(map(len, chosen)) for total in found]
        shares += [1 / len(choices) / len(found)] * len(found)
    order = np.argsort(means)
    return np.array(means)[order], np.cumsum(np.array(shares)[order])


@pytest.mark.parametrize("are_drawn", [False, True])
@pytest.mark.parametrize("level", [0.3, 0.5, 0.8, 0.95])
def test_ends_are_quantiles_of_all_that_can_be_drawn(are_drawn, level):
    # Differences vary within the groups, whose sizes differ.
    groups = [[0.0, 1.0], [0.0, 0.0, 4.0]]
    means, shares = every_mean(groups, are_drawn)
    found = paired_bootstrap(
        groups, np.random.default_rng(0), are_groups_drawn=are_drawn, level=level, num_draws=40_000
    )
    assert found.value == 1.0
    for end, quantile in ((found.low, (1 - level) / 2), (found.high, (1 + level) / 2)):
        below = shares[np.searchsorted(means, end - 1e-9) - 1] if end > means[0] else 0.0
        up_to = shares[np.searchsorted(means, end + 1e-9) - 1]
        assert below - 0.01 <= quantile <= up_to + 0.01


def test_one_scene_tells_nothing_of_others():
    with pytest.raises(ValueError) as error:
        paired_bootstrap([[0.0, 1.0], []], np.random.default_rng(0), are_groups_drawn=True)
    assert str(error.value) == "Got one scene to draw scenes from; expected at least two."


def test_same_generator_same_interval():
    groups = [np.random.default_rng(0).normal(size=20).tolist()]
    first, second = (paired_bootstrap(groups, np.random.default_rng(3)) for _ in range(2))
    assert first == second
    assert first != paired_bootstrap(groups, np.random.default_rng(4))


def test_bootstrap_refuses_no_pairs():
    with pytest.raises(ValueError) as error:
        paired_bootstrap([[], []], np.random.default_rng(0))
    assert str(error.value) == "Got no pairs to compare; expected at least one."
