import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates, ActionDecoding, ActionScores
from policy.errors import (
    CandidateIndexError,
    InvalidArrayError,
    NoCandidatesError,
    PolicyError,
)


def _fields(num_candidates: int = 3, **changes: Any) -> dict[str, Any]:
    return {
        "kind": "pick",
        "Ts_world_tool": np.tile(np.eye(4), (num_candidates, 1, 1)),
        "width_m": np.full(num_candidates, 0.04),
        "prior": np.full(num_candidates, 0.5),
    } | changes


def _broken_pose(row: int, column: int, value: float) -> np.ndarray:
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[1, row, column] = value
    return poses


NOT_RIGID = (
    "Ts_world_tool: got 1 of 3 poses that aren't rigid (first: 1), expected a rotation, a "
    "translation and the row 0 0 0 1."
)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "push"}, "kind: got 'push', expected 'pick' or 'place'."),
        (
            {"Ts_world_tool": np.zeros((3, 3, 4))},
            "Ts_world_tool: got shape (3, 3, 4), expected (K, 4, 4).",
        ),
        ({"width_m": np.zeros(2)}, "width_m: got shape (2,), expected (K=3,)."),
        ({"prior": np.zeros((3, 1))}, "prior: got shape (3, 1), expected (K=3,)."),
        ({"width_m": ["a", "b", "c"]}, "width_m: got dtype <U1, expected real numbers."),
        (
            {"prior": [0.5, np.nan, np.inf]},
            "prior: got 2 values that are NaN or infinite, expected finite values.",
        ),
        ({"width_m": [-0.01, 0, 0]}, "width_m: got values from -0.01 to 0, expected at least 0."),
        ({"prior": [0, 1, 1.5]}, "prior: got values from 0 to 1.5, expected 0 to 1."),
        ({"Ts_world_tool": _broken_pose(0, 0, -1.0)}, NOT_RIGID),
        ({"Ts_world_tool": _broken_pose(0, 0, 1.1)}, NOT_RIGID),
        ({"Ts_world_tool": _broken_pose(3, 3, 2.0)}, NOT_RIGID),
    ],
)
def test_bad_candidates(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidArrayError) as caught:
        ActionCandidates(**_fields(**changes))
    assert str(caught.value) == message
    assert isinstance(caught.value, PolicyError) and isinstance(caught.value, ValueError)


def test_candidates_are_read_only_copies() -> None:
    width_m = np.full(3, 0.04, dtype=np.float32)
    candidates = ActionCandidates(**_fields(width_m=width_m))
    width_m[:] = 7
    assert (candidates.width_m == np.float32(0.04)).all()
    for field in dataclasses.fields(candidates)[1:]:
        with pytest.raises(ValueError, match="read-only"):
            getattr(candidates, field.name)[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        candidates.kind = "place"  # type: ignore[misc]
    assert candidates.Ts_world_tool.dtype == np.float64
    assert candidates.width_m.dtype == candidates.prior.dtype == np.float32


def test_pose7_round_trip(make_candidates, rng: np.random.Generator) -> None:
    candidates = make_candidates(rng, 200)
    pose7 = candidates.as_pose7()
    assert pose7.shape == (200, 7) and pose7.dtype == np.float32
    np.testing.assert_allclose(pose7[:, :3], candidates.positions, atol=1e-7)
    rotations = Rotation.from_quat(pose7[:, 3:]).as_matrix()
    np.testing.assert_allclose(rotations, candidates.Ts_world_tool[:, :3, :3], atol=1e-6)
    assert (pose7[:, 6] >= 0).all()


def test_pose7_order_is_xyzw() -> None:
    poses = np.eye(4)[None].copy()
    poses[0, :3, :3] = Rotation.from_rotvec([0, 0, np.pi / 2]).as_matrix()
    pose7 = ActionCandidates(**_fields(1, Ts_world_tool=poses)).as_pose7()
    np.testing.assert_allclose(pose7[0], [0, 0, 0, 0, 0, 0.5**0.5, 0.5**0.5], atol=1e-7)


def test_no_candidates() -> None:
    candidates = ActionCandidates(**_fields(0, Ts_world_tool=np.zeros((0, 4, 4))))
    assert len(candidates) == 0
    assert candidates.as_pose7().shape == (0, 7)
    assert len(candidates.take(np.array([]))) == 0


def test_take_selects_in_order(make_candidates, rng: np.random.Generator) -> None:
    candidates = make_candidates(rng, 5, "place")
    taken = candidates.take(np.array([4, 0, 4]))
    assert taken.kind == "place"
    for name in ("Ts_world_tool", "width_m", "prior"):
        expected = getattr(candidates, name)[[4, 0, 4]]
        np.testing.assert_array_equal(getattr(taken, name), expected)


@pytest.mark.parametrize(
    ("indices", "message"),
    [
        ([0, 3], "indices: got 0 to 3, expected 0 to 2 for 3 candidates."),
        ([-1], "indices: got -1 to -1, expected 0 to 2 for 3 candidates."),
        ([0.5], "indices: got float64 of shape (1,), expected integers (M,)."),
        ([[0]], "indices: got int64 of shape (1, 1), expected integers (M,)."),
        ([True], "indices: got bool of shape (1,), expected integers (M,)."),
    ],
)
def test_bad_take(indices: list[Any], message: str) -> None:
    with pytest.raises(CandidateIndexError) as caught:
        ActionCandidates(**_fields()).take(np.array(indices))
    assert str(caught.value) == message


def test_probabilities_are_the_softmax() -> None:
    scores = ActionScores(logits=np.log([1.0, 2.0, 5.0]) + 1000.0)
    np.testing.assert_allclose(scores.probabilities, [0.125, 0.25, 0.625], rtol=1e-4)
    assert scores.best == 2


def test_best_is_the_first_among_equals() -> None:
    assert ActionScores(logits=np.array([1.0, 3.0, 3.0])).best == 1


def test_scores_of_nothing() -> None:
    scores = ActionScores(logits=np.zeros(0))
    assert scores.probabilities.shape == (0,)
    with pytest.raises(NoCandidatesError) as caught:
        _ = scores.best
    assert (
        str(caught.value)
        == "best: got 0 candidates, expected at least 1. Check len(candidates) first."
    )


def test_bad_scores() -> None:
    with pytest.raises(InvalidArrayError) as caught:
        ActionScores(logits=np.array([0.0, -np.inf]))
    assert (
        str(caught.value)
        == "logits: got 1 values that are NaN or infinite, expected finite values."
    )
    decoding = ActionDecoding(
        rotvec_tool=np.zeros((2, 3)), opening_m=np.zeros(2), avoid_collision=np.zeros(2)
    )
    with pytest.raises(InvalidArrayError) as caught:
        ActionScores(logits=np.zeros(3), decoding=decoding)
    assert str(caught.value) == "decoding: got 2 candidates, expected 3 as in logits."
