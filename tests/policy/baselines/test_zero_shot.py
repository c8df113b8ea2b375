"""What holds for every baseline that needs no training."""

import numpy as np
import pytest

from policy.base import Policy
from policy.registry import load_policy

NAMES = ("clip-grounding", "lerf-togo", "think-grasp", "vlp")
PICKING = NAMES[:3]
MIDDLES = np.array([[0.36, -0.12], [0.36, 0.1], [0.6, -0.1], [0.6, 0.12]])


def _scene(make_blocks, block, target: int, **changes):
    blocks = [
        block(x=x, y=y, similarity=0.7 if index == target else 0.4)
        for index, (x, y) in enumerate(MIDDLES)
    ]
    return make_blocks(blocks, target=target, noise=0.1, **changes)


def _grasp_positions(rng: np.random.Generator, which: np.ndarray) -> np.ndarray:
    positions = np.concatenate([MIDDLES[which], np.full((len(which), 1), 0.035)], axis=1)
    return positions + rng.normal(0, 0.004, positions.shape)


@pytest.mark.parametrize("name", NAMES)
def test_is_a_policy_of_that_name(name: str) -> None:
    policy = load_policy(name)
    assert isinstance(policy, Policy)
    assert policy.name == name


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("target", range(4))
def test_picks_the_object_asked_for(
    make_blocks, make_grasps, block, rng: np.random.Generator, name: str, target: int
) -> None:
    which = rng.permutation(np.repeat(np.arange(4), 6))
    # Bad priors on the target and good ones elsewhere must not tip the choice.
    prior = np.where(which == target, 0.2, 1.0)
    candidates = make_grasps(_grasp_positions(rng, which), prior)
    observation = _scene(make_blocks, block, target)
    scores = load_policy(name).score(observation, candidates, rng)
    assert which[scores.best] == target
    if name != "vlp":
        # Every grasp of the target comes before every other one.
        assert scores.logits[which == target].min() > scores.logits[which != target].max()


@pytest.mark.parametrize("name", ["lerf-togo", "think-grasp", "vlp"])
@pytest.mark.parametrize("kind", ["pick", "place"])
def test_order_of_candidates_orders_logits(
    make_blocks, make_grasps, block, rng: np.random.Generator, name: str, kind: str
) -> None:
    candidates = make_grasps(rng.uniform((0.3, -0.2, 0), (0.7, 0.2, 0.1), (30, 3)), kind=kind)
    observation = _scene(make_blocks, block, 1)
    order, policy = rng.permutation(30), load_policy(name)
    straight = policy.score(observation, candidates, rng).logits
    permuted = policy.score(observation, candidates.take(order), rng).logits
    np.testing.assert_allclose(permuted, straight[order], atol=1e-6)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["pick", "place"])
def test_same_seed_same_bytes(
    make_blocks, make_grasps, block, rng: np.random.Generator, name: str, kind: str
) -> None:
    candidates = make_grasps(rng.uniform((0.3, -0.2, 0), (0.7, 0.2, 0.1), (30, 3)), kind=kind)
    observation = _scene(make_blocks, block, 2)
    first, second = (
        load_policy(name).score(observation, candidates, np.random.default_rng(4)).logits
        for _ in range(2)
    )
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["pick", "place"])
def test_nothing_to_choose_from_and_nothing_to_see(
    empty, make_blocks, make_grasps, block, rng: np.random.Generator, name: str, kind: str
) -> None:
    policy = load_policy(name)
    seen = _scene(make_blocks, block, 0)
    assert len(policy.score(seen, make_grasps([], kind=kind), rng)) == 0
    assert len(policy.score(empty, make_grasps([], kind=kind), rng)) == 0
    unseen = policy.score(empty, make_grasps([[0.5, 0, 0.1]] * 3, [0.1, 0.9, 0.5], kind=kind), rng)
    assert len(unseen) == 3
    if name != "clip-grounding":
        assert unseen.best == 1


@pytest.mark.parametrize("name", PICKING)
def test_what_only_grasps_places_like_grounding(
    make_blocks, make_grasps, block, rng: np.random.Generator, name: str
) -> None:
    observation = _scene(make_blocks, block, 3, phase="place", relation="near", side="outside")
    places = make_grasps(rng.uniform((0.3, -0.2, 0), (0.7, 0.2, 0.1), (30, 3)), kind="place")
    expected = load_policy("grounding").score(observation, places, rng).logits
    found = load_policy(name).score(observation, places, rng).logits
    np.testing.assert_array_equal(found, expected)


def test_what_only_places_grasps_like_grounding(
    make_blocks, make_grasps, block, rng: np.random.Generator
) -> None:
    observation = _scene(make_blocks, block, 3)
    grasps = make_grasps(rng.uniform((0.3, -0.2, 0), (0.7, 0.2, 0.1), (30, 3)))
    expected = load_policy("grounding").score(observation, grasps, rng).logits
    np.testing.assert_array_equal(
        load_policy("vlp").score(observation, grasps, rng).logits, expected
    )
