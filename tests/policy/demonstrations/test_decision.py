from dataclasses import replace

import numpy as np
import pytest

from policy.demonstrations import Demonstration
from policy.errors import InvalidArrayError, InvalidDemonstrationsError


def test_arrays_are_copies_that_cannot_be_written(make_look, make_decision):
    points = np.zeros((30, 3)) + 0.3
    look = make_look(points=points)
    points[:] = 9
    assert look.points.max() < 1
    decision = make_decision()
    wording = decision.wordings[0]
    for array in (look.features, decision.valid, decision.expert_logits, wording.similarity):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@pytest.mark.parametrize("phase", ["pick", "place"])
def test_observation_is_what_the_policy_would_have_seen(make_look, make_decision, phase):
    look, decision = make_look(), make_decision(phase)
    demonstration = Demonstration(look=look, decision=decision, scene="s")
    for number, wording in enumerate(decision.wordings):
        seen = demonstration.observation(number)
        assert (seen.phase, seen.relation, seen.side) == (
            phase,
            decision.relation,
            decision.side,
        )
        for name in ("points", "features", "confidence", "workspace_min", "workspace_max"):
            np.testing.assert_array_equal(getattr(seen, name), getattr(look, name))
        np.testing.assert_array_equal(seen.text_tokens, wording.tokens)
        np.testing.assert_array_equal(seen.text_pooled, wording.pooled)
        np.testing.assert_array_equal(seen.similarity, wording.similarity)
        assert (seen.phrase_pooled is None) == (wording.phrase_pooled is None)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wordings": ()}, "wordings: got none, expected at least 1."),
        ({"executed": 1}, "executed: got 1, expected one of the valid candidates [0, 2, 4, 6]."),
        ({"executed": 7}, "executed: got 7, expected one of the valid candidates [0, 2, 4, 6]."),
        ({"valid": np.ones(3, bool)}, "valid: got shape (3,), expected (7,)."),
        (
            {"phase": "place"},
            "phase: got 'place' with candidates to pick, expected the same.",
        ),
        (
            {"relation": "near"},
            "relation and side: got 'near' and None in the pick phase, expected both for placing and none for picking.",
        ),
        (
            {"avoid_collision": np.full(7, 2.0)},
            "avoid_collision: got values from 2 to 2, expected 0 to 1.",
        ),
        ({"expert_logits": np.zeros(3)}, "expert_logits: got shape (3,), expected (K=7,)."),
    ],
)
def test_bad_decisions_are_refused(make_decision, changes, message):
    with pytest.raises(InvalidArrayError) as error:
        replace(make_decision(), **changes)
    assert str(error.value) == message


def test_only_picks_clear(make_decision):
    assert replace(make_decision(), clears=True).clears
    with pytest.raises(InvalidArrayError) as error:
        replace(make_decision("place"), clears=True)
    assert str(error.value) == "clears: got True for a place, expected it of grasps alone."


def test_blank_wordings_and_bad_looks_are_refused(make_wording, make_look):
    with pytest.raises(InvalidArrayError, match=r"^text: got ' ', expected at least one word\.$"):
        make_wording(text=" ")
    with pytest.raises(InvalidArrayError, match=r"^features: got shape \(3, 2\), expected \(N=30"):
        make_look(features=np.ones((3, 2)))
    with pytest.raises(InvalidArrayError, match=r"^confidence: got values from -1"):
        make_look(confidence=np.full(30, -1.0))


def test_a_look_of_other_points_is_refused(make_look, make_decision):
    with pytest.raises(InvalidDemonstrationsError) as error:
        Demonstration(look=make_look(num_points=31), decision=make_decision(), scene="s")
    assert str(error.value) == (
        "Scene 's': the wording 'give me the pear' is for 30 points and 16 channels, the look has "
        "31 and 16."
    )
