from typing import Any

import numpy as np
import pytest

from policy.errors import InvalidArrayError


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": np.zeros((4, 2))}, "points: got shape (4, 2), expected (N, 3)."),
        ({"features": np.zeros((5, 16))}, "features: got shape (5, 16), expected (N=4, C)."),
        ({"similarity": np.zeros(3)}, "similarity: got shape (3,), expected (N=4,)."),
        ({"text_tokens": np.zeros((2, 9))}, "text_tokens: got shape (2, 9), expected (T, C=16)."),
        ({"text_pooled": np.zeros(9)}, "text_pooled: got shape (9,), expected (C=16,)."),
        (
            {"points": np.full((4, 3), np.nan)},
            "points: got 12 values that are NaN or infinite, expected finite values.",
        ),
        (
            {"confidence": np.array([1, -1, 0, 0.5])},
            "confidence: got values from -1 to 1, expected at least 0.",
        ),
        (
            {"workspace_max": np.array([1.0, -0.3, 1.0])},
            "workspace: got corners [0.276, -0.224, 0.0] and [1.0, -0.3, 1.0], expected min < max "
            "on every axis.",
        ),
        ({"phrase_pooled": np.zeros(9)}, "phrase_pooled: got shape (9,), expected (C=16,)."),
        ({"phase": "push"}, "phase: got 'push', expected 'pick' or 'place'."),
        (
            {"phase": "place", "relation": "under", "side": "below"},
            "side: got 'below', expected 'inside' or 'outside'.",
        ),
        (
            {"phase": "place", "relation": "near"},
            "relation and side: got 'near' and None, expected both or neither.",
        ),
        (
            {"relation": "near", "side": "outside"},
            "relation: got 'near' in the pick phase, expected None.",
        ),
    ],
)
def test_bad_observation(
    make_observation, rng: np.random.Generator, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidArrayError) as caught:
        make_observation(rng, 4, **changes)
    assert str(caught.value) == message


def test_observation_holds_read_only_copies(make_observation, rng: np.random.Generator) -> None:
    points = rng.uniform(0, 0.3, (4, 3))
    observation = make_observation(rng, 4, points=points)
    expected = points.astype(np.float32)
    points[:] = 0
    np.testing.assert_array_equal(observation.points, expected)
    assert observation.points.dtype == np.float32
    assert not observation.features.flags.writeable
    assert (observation.num_points, observation.feature_dim) == (4, 16)


def test_empty_cloud_is_valid(make_observation, rng: np.random.Generator) -> None:
    assert make_observation(rng, 0, num_tokens=0).num_points == 0


def test_place_phase(make_observation, rng: np.random.Generator) -> None:
    phrase = rng.normal(size=16)
    observation = make_observation(
        rng, 4, phase="place", relation="near", side="outside", phrase_pooled=phrase
    )
    np.testing.assert_array_equal(observation.phrase_pooled, phrase.astype(np.float32))
    assert not observation.phrase_pooled.flags.writeable
    assert (observation.phase, observation.relation, observation.side) == (
        "place",
        "near",
        "outside",
    )


def test_by_default_nothing_is_said_of_a_place(make_observation, rng: np.random.Generator) -> None:
    observation = make_observation(rng, 4)
    assert observation.phase == "pick" and observation.phrase_pooled is None
    assert observation.relation is None and observation.side is None
