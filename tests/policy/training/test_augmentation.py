import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from policy.training.augmentation import (
    augment,
    draw_channel_change,
    kept_points,
    rotation_about_vertical,
)
from policy.training.config import NO_AUGMENTATION


def _options(**changes: float):
    return dataclasses.replace(NO_AUGMENTATION, **changes)


@pytest.fixture
def scene(make_observation, make_candidates, rng):
    return make_observation(rng, 50), make_candidates(rng, 9)


def _assert_equal_fields(first: object, second: object) -> None:
    for field in dataclasses.fields(first):  # type: ignore[arg-type]
        np.testing.assert_array_equal(getattr(first, field.name), getattr(second, field.name))


def test_nothing_changes_without_augmentation(scene, rng) -> None:
    changed = augment(*scene, NO_AUGMENTATION, rng, max_points=1000)
    _assert_equal_fields(changed[0], scene[0])
    np.testing.assert_allclose(changed[1].Ts_world_tool, scene[1].Ts_world_tool, atol=1e-12)
    np.testing.assert_array_equal(changed[1].prior, scene[1].prior)


def test_rotation_keeps_what_labels_depend_on(scene, rng) -> None:
    observation, candidates = scene
    turned, moved = augment(*scene, _options(rotation_deg=180.0), rng, max_points=1000)
    assert np.abs(turned.points - observation.points).max() > 0.01
    # Heights, and every distance between candidates and points.
    np.testing.assert_allclose(turned.points[:, 2], observation.points[:, 2], atol=1e-6)
    np.testing.assert_allclose(
        cdist(moved.positions, turned.points),
        cdist(candidates.positions, observation.points),
        atol=1e-6,
    )
    # Where every point lies in the frame of every tool: orientations turn along.
    for T_old, T_new in zip(candidates.Ts_world_tool, moved.Ts_world_tool, strict=True):
        old = (observation.points - T_old[:3, 3]) @ T_old[:3, :3]
        new = (turned.points - T_new[:3, 3]) @ T_new[:3, :3]
        np.testing.assert_allclose(new, old, atol=1e-6)
    np.testing.assert_array_equal(turned.workspace_min, observation.workspace_min)
    np.testing.assert_array_equal(moved.width_m, candidates.width_m)


def test_rotation_is_about_the_middle_and_counter_clockwise() -> None:
    T = rotation_about_vertical(np.array([0.5, 0.1, 0.2]), math.pi / 2)
    np.testing.assert_allclose(T @ [0.5, 0.1, 0.7, 1], [0.5, 0.1, 0.7, 1])
    np.testing.assert_allclose(T @ [0.6, 0.1, 0.0, 1], [0.5, 0.2, 0.0, 1])


@pytest.mark.parametrize("limit", [10.0, 90.0])
def test_angles_stay_within_the_limit(scene, limit: float) -> None:
    def angle(seed: int) -> float:
        rng = np.random.default_rng(seed)
        _, moved = augment(*scene, _options(rotation_deg=limit), rng, max_points=1000)
        R = moved.Ts_world_tool[0, :3, :3] @ scene[1].Ts_world_tool[0, :3, :3].T
        return math.degrees(math.atan2(R[1, 0], R[0, 0]))

    angles = [angle(seed) for seed in range(40)]
    assert -limit <= min(angles) < -0.5 * limit and 0.5 * limit < max(angles) <= limit


def test_point_dropout_keeps_rows_together(scene, rng) -> None:
    observation, _ = scene
    thinned, _ = augment(*scene, _options(point_dropout=0.5), rng, max_points=1000)
    assert 25 <= thinned.num_points < 50
    rows = [observation.points.tolist().index(point) for point in thinned.points.tolist()]
    assert rows == sorted(set(rows))
    for name in ("features", "similarity", "confidence"):
        np.testing.assert_array_equal(getattr(thinned, name), getattr(observation, name)[rows])


@pytest.mark.parametrize(
    ("num_points", "share", "max_points", "low", "high"),
    [(100, 0.0, 1000, 100, 100), (100, 0.0, 30, 30, 30), (100, 0.2, 1000, 80, 100),
     (125, 0.2, 100, 100, 100), (1, 0.9, 10, 1, 1), (0, 0.5, 10, 0, 0)],
)  # fmt: skip
def test_number_of_points(
    num_points: int, share: float, max_points: int, low: int, high: int
) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        kept = kept_points(num_points, share, rng, max_points=max_points)
        assert low <= len(kept) <= high and len(set(kept)) == len(kept)


def test_feature_dropout_hits_points_and_texts_alike(scene, rng) -> None:
    observation, _ = scene
    changed, _ = augment(*scene, _options(feature_dropout=0.3), rng, max_points=1000)
    off = changed.text_pooled == 0
    assert 0 < off.sum() < len(off)
    for name in ("features", "text_tokens", "text_pooled"):
        before, after = getattr(observation, name), getattr(changed, name)
        assert (after[..., off] == 0).all()
        np.testing.assert_allclose(after[..., ~off], before[..., ~off] / math.sqrt(0.7), rtol=1e-6)
    np.testing.assert_array_equal(changed.points, observation.points)


def test_feature_dropout_keeps_cosines_on_average(rng) -> None:
    a, b = rng.normal(size=(2, 64))
    options = _options(feature_dropout=0.2, channel_shuffle=0.5)
    changes = [draw_channel_change(64, options, rng) for _ in range(4000)]
    products = [change(a) @ change(b) for change in changes]
    assert np.mean(products) == pytest.approx(a @ b, abs=5 * np.std(products) / math.sqrt(4000))


def test_shuffled_channels_keep_every_product(scene, rng) -> None:
    """Nothing that a cosine says is lost, and what a channel says is."""
    observation, _ = scene
    changed, _ = augment(*scene, _options(channel_shuffle=1.0), rng, max_points=1000)
    for text in ("text_tokens", "text_pooled"):
        np.testing.assert_allclose(
            getattr(changed, text) @ changed.features.T,
            getattr(observation, text) @ observation.features.T,
            atol=1e-5,
        )
    np.testing.assert_allclose(
        changed.features @ changed.features.T, observation.features @ observation.features.T,
        atol=1e-5,
    )  # fmt: skip
    size = np.sort(np.abs(observation.features), axis=1)
    np.testing.assert_array_equal(np.sort(np.abs(changed.features), axis=1), size)
    assert (np.abs(changed.features) != np.abs(observation.features)).mean() > 0.5
    assert (np.sort(changed.features, axis=1) != np.sort(observation.features, axis=1)).any()
    np.testing.assert_array_equal(changed.points, observation.points)
    np.testing.assert_array_equal(changed.similarity, observation.similarity)


def test_share_of_draws_with_shuffled_channels(rng) -> None:
    changes = [draw_channel_change(8, _options(channel_shuffle=0.25), rng) for _ in range(2000)]
    is_shuffled = [(change.order != np.arange(8)).any() for change in changes]
    assert np.mean(is_shuffled) == pytest.approx(0.25, abs=0.05)
    plain = [change for change, is_ in zip(changes, is_shuffled, strict=True) if not is_]
    assert all((change.factor == 1).all() for change in plain)


def test_jitter_has_its_standard_deviation(make_observation, make_candidates, rng) -> None:
    observation, candidates = make_observation(rng, 4000), make_candidates(rng, 3)
    shaken, same = augment(observation, candidates, _options(jitter_m=0.003), rng, max_points=9999)
    shift = shaken.points - observation.points
    np.testing.assert_allclose(shift.std(axis=0), 0.003, rtol=0.1)
    np.testing.assert_allclose(shift.mean(axis=0), 0.0, atol=0.0003)
    np.testing.assert_allclose(same.Ts_world_tool, candidates.Ts_world_tool, atol=1e-12)


def test_prior_stays_a_quality(make_observation, make_candidates, rng) -> None:
    observation, candidates = make_observation(rng, 5), make_candidates(rng, 2000)
    _, noisy = augment(observation, candidates, _options(prior_noise=0.1), rng, max_points=10)
    inner = (candidates.prior > 0.3) & (candidates.prior < 0.7)
    assert (noisy.prior - candidates.prior)[inner].std() == pytest.approx(0.1, rel=0.1)
    assert noisy.prior.min() >= 0 and noisy.prior.max() <= 1
