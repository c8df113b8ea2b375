from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from policy.actions import ActionCandidates
from policy.errors import InvalidConfigError
from policy.grounding import GroundingConfig, GroundingPolicy
from policy.observation import Observation

CENTERS = np.array([[0.4, -0.1, 0.03], [0.5, 0.1, 0.03], [0.6, 0.0, 0.03]])
POINTS_PER_OBJECT = 120


def _cloud(
    rng: np.random.Generator, make_observation: Any, *, target: int, noise: float = 0.0
) -> Observation:
    """Three objects on a table; the target is 0.05 more similar than everything else."""
    objects = [center + rng.normal(0, 0.012, (POINTS_PER_OBJECT, 3)) for center in CENTERS]
    table = np.c_[rng.uniform(0.3, 0.7, 800), rng.uniform(-0.2, 0.2, 800), np.zeros(800)]
    points = np.concatenate([*objects, table])
    similarity = 0.2 + noise * rng.normal(size=len(points))
    start = target * POINTS_PER_OBJECT
    similarity[start : start + POINTS_PER_OBJECT] += 0.05
    return make_observation(
        rng,
        len(points),
        points=points,
        similarity=similarity,
        confidence=np.ones(len(points)),
    )


def _grasps(positions: np.ndarray, prior: np.ndarray | float = 0.5, kind: str = "pick") -> Any:
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    prior = np.broadcast_to(prior, len(positions))
    width_m = np.full(len(positions), 0.04)
    return ActionCandidates(kind=kind, Ts_world_tool=poses, width_m=width_m, prior=prior)


@pytest.mark.parametrize("target", range(3))
@pytest.mark.parametrize("noise", [0.0, 0.025, 0.05])
def test_picks_on_the_similar_object(
    make_observation, rng: np.random.Generator, target: int, noise: float
) -> None:
    observation = _cloud(rng, make_observation, target=target, noise=noise)
    which = np.arange(30) % 3
    # Bad priors on the target and good ones elsewhere must not tip the choice.
    candidates = _grasps(
        CENTERS[which] + rng.normal(0, 0.005, (30, 3)), np.where(which == target, 0.1, 1.0)
    )
    assert which[GroundingPolicy().score(observation, candidates, rng).best] == target


def test_a_single_outlier_does_not_decide(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=1)
    similarity = observation.similarity.copy()
    similarity[7] = 0.35  # a point on object 0, three times as far from the background
    noisy = make_observation(
        rng,
        observation.num_points,
        points=observation.points,
        similarity=similarity,
        confidence=observation.confidence,
    )
    assert GroundingPolicy().score(noisy, _grasps(CENTERS), rng).best == 1


def test_prior_decides_on_one_object(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=2)
    candidates = _grasps(CENTERS[[2, 2, 2]], np.array([0.2, 0.9, 0.5]))
    assert GroundingPolicy().score(observation, candidates, rng).best == 1


def test_grasp_in_the_air_loses(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=0)
    candidates = _grasps(np.array([CENTERS[0] + np.array([0, 0, 0.15]), CENTERS[0]]))
    assert GroundingPolicy().score(observation, candidates, rng).best == 1


@pytest.mark.parametrize("target", range(3))
def test_what_is_nearest_to_a_blocked_target_is_grasped(
    make_observation, rng: np.random.Generator, target: int
) -> None:
    """Though other objects are a little similar, and the grasps on them are better."""
    observation = _cloud(rng, make_observation, target=target)
    others = [index for index in range(3) if index != target]
    towards = CENTERS[target] - CENTERS[others[0]]
    beside = CENTERS[target] + 0.09 * towards / np.linalg.norm(towards)
    similarity = observation.similarity.copy()
    on_others = np.linalg.norm(observation.points - CENTERS[target], axis=1) > 0.05
    similarity[on_others] = 0.2 + 0.1 * rng.random(on_others.sum())
    similarity[~on_others] = 0.4
    observation = replace(observation, similarity=similarity.astype(np.float32))
    candidates = _grasps(np.stack([*CENTERS[others], beside]), np.array([1.0, 1.0, 0.3]))
    policy = GroundingPolicy()
    assert policy.score(observation, candidates, rng).best == 2
    # Where the target itself can be grasped, the same grasp gains nothing.
    candidates = _grasps(np.stack([CENTERS[target], beside]), np.array([0.1, 1.0]))
    assert policy.score(observation, candidates, rng).best == 0


def test_place_ignores_height(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=1)
    lifted = np.concatenate([CENTERS, CENTERS + np.array([0, 0, 0.1])])
    logits = GroundingPolicy().score(observation, _grasps(lifted, kind="place"), rng).logits
    np.testing.assert_allclose(logits[:3], logits[3:], atol=1e-5)
    assert logits.argmax() == 1


def _for_place(observation: Observation, make_observation: Any, side: str) -> Observation:
    relation = {"inside": "on", "outside": "near"}[side]
    return make_observation(
        np.random.default_rng(0),
        observation.num_points,
        points=observation.points,
        similarity=observation.similarity,
        confidence=observation.confidence,
        phase="place",
        relation=relation,
        side=side,
    )


@pytest.mark.parametrize("target", range(3))
@pytest.mark.parametrize("noise", [0.0, 0.025])
def test_places_inside_over_the_middle_of_the_reference(
    make_observation, rng: np.random.Generator, target: int, noise: float
) -> None:
    cloud = _cloud(rng, make_observation, target=target, noise=noise)
    observation = _for_place(cloud, make_observation, "inside")
    beside = CENTERS[target] + [[0.1, 0.0, 0.05], [0.04, 0.0, 0.05], [0.0, 0.0, 0.08]]
    places = np.concatenate([CENTERS, beside])
    prior = np.where(np.arange(6) == 5, 0.1, 1.0)
    # Over another object nothing is wrong with the prior; over the reference the height is free.
    scores = GroundingPolicy().score(observation, _grasps(places, prior, kind="place"), rng)
    assert scores.best in (target, 5)
    assert scores.logits[5] > scores.logits[4] > scores.logits[3]


@pytest.mark.parametrize("target", range(3))
@pytest.mark.parametrize("noise", [0.0, 0.025])
def test_places_around_in_the_middle_of_the_ring(
    make_observation, rng: np.random.Generator, target: int, noise: float
) -> None:
    cloud = _cloud(rng, make_observation, target=target, noise=noise)
    observation = _for_place(cloud, make_observation, "outside")
    radius = np.array([0.0, 0.05, 0.09, 0.13, 0.17, 0.21, 0.3])
    places = CENTERS[target] + np.c_[-radius, 0 * radius, np.full(7, 0.05)]
    logits = GroundingPolicy().score(observation, _grasps(places, kind="place"), rng).logits
    distance = [
        np.linalg.norm(
            cloud.points[target * POINTS_PER_OBJECT :][:POINTS_PER_OBJECT, :2] - place, axis=1
        ).min()
        for place in places[:, :2]
    ]
    assert abs(distance[int(logits.argmax())] - 0.1) < 0.025
    assert logits[0] < logits[2] > logits[-1]


@pytest.mark.parametrize(("side", "best"), [("inside", 0), ("outside", 1)])
def test_place_score_ignores_height_and_order(
    make_observation, rng: np.random.Generator, side: str, best: int
) -> None:
    cloud = _cloud(rng, make_observation, target=0)
    observation = _for_place(cloud, make_observation, side)
    places = np.array([CENTERS[0], CENTERS[0] - [0.13, 0, 0], CENTERS[2]])
    lifted = np.concatenate([places, np.add(places[::-1], [0, 0, 0.1])])
    logits = GroundingPolicy().score(observation, _grasps(lifted, kind="place"), rng).logits
    np.testing.assert_allclose(logits[:3], logits[3:][::-1], atol=1e-6)
    assert logits[:3].argmax() == best


@pytest.mark.parametrize("num_points", [0, 1, 50])
def test_without_contrast_the_prior_decides(
    make_observation, rng: np.random.Generator, num_points: int
) -> None:
    observation = make_observation(rng, num_points, similarity=np.full(num_points, 0.2))
    candidates = _grasps(CENTERS, np.array([0.0, 0.3, 1.0]))
    scores = GroundingPolicy().score(observation, candidates, rng)
    np.testing.assert_allclose(scores.logits, 0.5 * np.log([1e-3, 0.3, 1.0]), rtol=1e-6, atol=1e-12)


def test_points_without_confidence_do_not_count(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=0)
    confidence = observation.confidence.copy()
    similarity = observation.similarity.copy()
    confidence[POINTS_PER_OBJECT : 2 * POINTS_PER_OBJECT : 2] = 0
    similarity[POINTS_PER_OBJECT : 2 * POINTS_PER_OBJECT : 2] = 0.9
    doubtful = make_observation(
        rng,
        observation.num_points,
        points=observation.points,
        similarity=similarity,
        confidence=confidence,
    )
    assert GroundingPolicy().score(doubtful, _grasps(CENTERS), rng).best == 0


def test_order_of_points_and_candidates(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=1, noise=0.02)
    candidates = _grasps(rng.uniform([0.3, -0.2, 0], [0.7, 0.2, 0.1], (20, 3)))
    logits = GroundingPolicy().score(observation, candidates, rng).logits
    points, order = rng.permutation(observation.num_points), rng.permutation(20)
    shuffled = make_observation(
        rng,
        observation.num_points,
        points=observation.points[points],
        similarity=observation.similarity[points],
        confidence=observation.confidence[points],
    )
    again = GroundingPolicy().score(shuffled, candidates.take(order), rng).logits
    np.testing.assert_allclose(again, logits[order], atol=1e-5)


def test_same_input_same_bytes(make_observation, rng: np.random.Generator) -> None:
    observation = _cloud(rng, make_observation, target=1, noise=0.05)
    first, second = (
        GroundingPolicy().score(observation, _grasps(CENTERS), np.random.default_rng(seed)).logits
        for seed in (0, 1)
    )
    assert first.tobytes() == second.tobytes()


def test_no_candidates(make_observation, rng: np.random.Generator) -> None:
    scores = GroundingPolicy().score(make_observation(rng), _grasps(np.zeros((0, 3))), rng)
    assert len(scores) == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pick_sigma_m": 0.0}, "pick_sigma_m: got 0, expected a value above 0."),
        ({"temperature": -1.0}, "temperature: got -1, expected a value above 0."),
        ({"blocked_m": 0.0}, "blocked_m: got 0, expected a value above 0."),
        ({"ring_m": 0.0}, "ring_m: got 0, expected a value above 0."),
        ({"grow_level": 0.0}, "grow_level: got 0, expected a value between 0 and 1."),
        ({"region_level": 1.0}, "region_level: got 1, expected a value between 0 and 1."),
        ({"region_weight": 1.5}, "region_weight: got 1.5, expected 0 to 1."),
        ({"prior_exponent": -0.1}, "prior_exponent: got -0.1, expected at least 0."),
    ],
)
def test_bad_config(changes: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        GroundingConfig(**changes)
    assert str(caught.value) == message
