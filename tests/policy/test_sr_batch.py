from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
import torch

from policy.actions import ActionCandidates
from policy.errors import InvalidArrayError
from policy.network.batch import choose_points, collate, make_sample


def test_workspace_spans_minus_one_to_one(make_observation, make_config, rng) -> None:
    corners = np.array([[0.276, -0.224, 0.0], [0.724, 0.224, 0.4], [0.5, 0.0, 0.2]])
    observation = make_observation(rng, 3, points=corners)
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, :3, 3] = corners
    candidates = ActionCandidates(
        kind="place", Ts_world_tool=poses, width_m=np.zeros(3), prior=np.zeros(3)
    )
    sample = make_sample(observation, candidates, make_config())
    expected = np.array([[-1, -1, -1], [1, 1, 1], [0, 0, 0]])
    np.testing.assert_allclose(sample.positions, expected, atol=1e-6)
    np.testing.assert_allclose(sample.poses[:, :3], expected, atol=1e-6)
    np.testing.assert_allclose(sample.poses[:, 3:], [[0, 0, 0, 1]] * 3, atol=1e-7)
    assert sample.phase == 1
    assert not sample.poses.flags.writeable


def test_large_clouds_are_thinned_consistently(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    observation = make_observation(rng, 200)
    sample = make_sample(observation, make_candidates(rng), make_config(max_points=64))
    assert sample.features.shape == (64, 16)
    for row, similarity in zip(sample.features, sample.similarity, strict=True):
        source = np.flatnonzero((observation.features == row).all(axis=1))
        assert observation.similarity[source].tolist() == [similarity]


def test_collate_pads_and_masks(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    config = make_config()
    samples = [
        make_sample(make_observation(rng, 10, 4), make_candidates(rng, 3), config),
        make_sample(make_observation(rng, 6, 9), make_candidates(rng, 5, "place"), config),
    ]
    batch = collate(samples)
    assert batch.positions.shape == (2, 10, 3) and batch.features.shape == (2, 10, 16)
    assert batch.tokens.shape == (2, 9, 16) and batch.poses.shape == (2, 5, 7)
    assert batch.point_mask.sum(dim=1).tolist() == [10, 6]
    assert batch.token_mask.sum(dim=1).tolist() == [4, 9]
    assert batch.candidate_mask.sum(dim=1).tolist() == [3, 5]
    assert batch.phase.tolist() == [0, 1]
    assert not batch.features[1, 6:].any() and not batch.poses[0, 3:].any()
    for i, sample in enumerate(samples):
        np.testing.assert_array_equal(batch.tokens[i, : len(sample.tokens)], sample.tokens)


@pytest.mark.parametrize(
    ("kind", "changes", "phase"),
    [
        ("pick", {}, 0),
        ("place", {"phase": "place"}, 1),
        ("place", {"phase": "place", "relation": "into", "side": "inside"}, 2),
        ("place", {"phase": "place", "relation": "near", "side": "outside"}, 3),
    ],
)
def test_phase_tells_which_side_is_asked_for(
    make_observation,
    make_candidates,
    make_config,
    rng: np.random.Generator,
    kind: str,
    changes: dict[str, Any],
    phase: int,
) -> None:
    observation = make_observation(rng, **changes)
    sample = make_sample(observation, make_candidates(rng, kind=kind), make_config())
    assert sample.phase == phase


def test_prior_and_phrase_are_taken_along(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    candidates, phrase = make_candidates(rng), rng.normal(size=16).astype(np.float32)
    whole = make_sample(make_observation(rng), candidates, make_config())
    apart = make_sample(make_observation(rng, phrase_pooled=phrase), candidates, make_config())
    np.testing.assert_array_equal(whole.phrase, whole.pooled)
    np.testing.assert_array_equal(apart.phrase, phrase)
    batch = collate([whole, apart])
    np.testing.assert_array_equal(batch.prior, [candidates.prior] * 2)
    np.testing.assert_array_equal(batch.phrase[1], phrase)


def test_points_may_be_chosen_beforehand(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    observation, candidates = make_observation(rng, 200), make_candidates(rng)
    config = make_config(max_points=32)
    expected = make_sample(observation, candidates, config)
    chosen = choose_points(observation, config)
    again = make_sample(observation, candidates, config, chosen=chosen)
    np.testing.assert_array_equal(again.features, expected.features)
    few = make_sample(observation, candidates, config, chosen=chosen[:5])
    np.testing.assert_array_equal(few.positions, expected.positions[:5])


def test_move_to_a_device_keeps_everything(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    batch = collate([make_sample(make_observation(rng), make_candidates(rng), make_config())])
    moved = batch.to("cpu")
    assert moved.objects is None and batch.objects is None
    names = [f.name for f in fields(batch) if f.name != "objects"]
    assert all(torch.equal(getattr(moved, name), getattr(batch, name)) for name in names)


def test_wrong_number_of_channels(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    with pytest.raises(InvalidArrayError) as caught:
        make_sample(make_observation(rng), make_candidates(rng), make_config(feature_dim=768))
    assert str(caught.value) == (
        "features: got 16 channels, expected 768 as in the network. Use the encoder that the "
        "network was trained with."
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"positions": np.zeros((4, 2))}, "positions: got shape (4, 2), expected (N, 3)."),
        ({"poses": np.zeros((7, 6))}, "poses: got shape (7, 6), expected (K, 7)."),
        ({"prior": np.zeros(3)}, "prior: got shape (3,), expected (K=7,)."),
        ({"prior": np.full(7, 1.5)}, "prior: got values from 1.5 to 1.5, expected 0 to 1."),
        ({"phrase": np.zeros(8)}, "phrase: got shape (8,), expected (C=16,)."),
        (
            {"phase": 4},
            "phase: got 4, expected one of 0 (pick), 1 (place), 2 (place inside), 3 (place outside).",
        ),
    ],
)
def test_bad_sample(
    make_observation,
    make_candidates,
    make_config,
    rng: np.random.Generator,
    changes: dict[str, Any],
    message: str,
) -> None:
    sample = make_sample(make_observation(rng), make_candidates(rng), make_config())
    with pytest.raises(InvalidArrayError) as caught:
        replace(sample, **changes)
    assert str(caught.value) == message


def test_bad_batches(
    make_observation, make_candidates, make_config, rng: np.random.Generator
) -> None:
    with pytest.raises(InvalidArrayError) as caught:
        collate([])
    assert str(caught.value) == "samples: got 0, expected at least 1."
    sample = make_sample(make_observation(rng), make_candidates(rng), make_config())
    narrow = replace(
        sample,
        features=sample.features[:, :8],
        tokens=sample.tokens[:, :8],
        pooled=sample.pooled[:8],
        phrase=sample.phrase[:8],
    )
    with pytest.raises(InvalidArrayError) as caught:
        collate([sample, narrow])
    assert str(caught.value) == "samples: got features of [8, 16] channels, expected one size."
