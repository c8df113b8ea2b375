import pytest

from sr_mj.evaluation.identity import NOT_KNOWN_BEFORE
from sr_mj.evaluation.mixture import is_same_result, mixtures

PLACE8 = {"scene": "place8", "task": "random-place8"}


@pytest.fixture
def mixed(make_done, as_lines):
    """Return a function that makes two lines, the second of which differs in some entries."""

    def make(policy="sr", where=None, **changes):
        first, second = (make_done(policy, seed, **(where or {})) for seed in (0, 1))
        lines = as_lines([first, second])
        lines[second.episode] = {**second.record, **changes}
        return lines

    return make


def test_equal_lines_are_no_mixture(mixed):
    assert mixtures(mixed()) == mixtures(mixed(where=PLACE8)) == []


@pytest.mark.parametrize(
    ("changes", "note"),
    [
        (
            {"weights_sha256": "0"},
            "sr: 2 different weights under this name, counted together.",
        ),
        (
            {"card_sha256": "0"},
            "sr: 2 different cards of weights under this name, counted together.",
        ),
        ({"encoder_fingerprint": "9"}, "The policies looked through 2 encoders (0123, 9)."),
        ({"cameras": "a2"}, "The episodes were run with 2 camera presets (sr, a2)."),
        ({"max_attempts": 3}, "The episodes were run with 2 numbers of attempts (8, 3)."),
        (
            {"generator": "file"},
            "The episodes were run with 2 generators of grasps (antipodal, file).",
        ),
        (
            {"keep_unreachable": True},
            "The episodes were run with 2 settings of keep_unreachable (False, True).",
        ),
        (
            {"arrangement_sha256": "0"},
            "grasp-seen-02: 2 different arrangements under this name.",
        ),
        ({"revision": None}, "The episodes were run with 2 revisions of the code."),
        ({"versions": {"mujoco": "4"}}, "The episodes were run with 2 sets of packages."),
    ],
)
def test_whatever_differs_is_told(mixed, changes, note):
    lines = mixed(**changes)
    assert mixtures(lines) == [note]
    # What a line of an earlier version lacks is not known, and no difference.
    (name,) = changes
    for record in lines.values():
        if record[name] == changes[name] and name != "arrangement_sha256":
            del record[name]
            assert mixtures(lines) == []


def test_who_does_not_look_has_no_encoder(mixed):
    assert mixtures(mixed("random", encoder_fingerprint="9")) == []


def test_scenes_of_two_makers_are_told(mixed, make_done, as_lines):
    assert mixtures(mixed(where=PLACE8, scene_maker="tools.mine")) == [
        "random-place8: scenes of 2 makers (sr_mj.scene.make_scene, tools.mine)."
    ]
    # Without a maker, as in lines of earlier versions, the goals tell.
    dones = [make_done(p, goal=f"goal of {p}", **PLACE8) for p in ("sr", "random")]
    lines = as_lines(dones)
    for record in lines.values():
        del record["scene_maker"]
    assert mixtures(lines) == [
        "random-place8: 1 scenes had other objects or another goal with one policy than with "
        "another, under the same seed; paired differences do not hold there."
    ]


def test_the_same_result_of_other_code_is_the_same(make_done):
    record = make_done().record
    assert is_same_result(record, {**record, "revision": "x", "versions": None})
    old = {name: value for name, value in record.items() if name not in NOT_KNOWN_BEFORE}
    assert is_same_result(record, old) and is_same_result(old, record)
    more = {**record, "attempts": [{**attempt, "new": 1} for attempt in record["attempts"]]}
    assert is_same_result(record, more)
    for changes in (
        {"success": False},
        {"weights_sha256": "0"},
        {"attempts": record["attempts"][1:]},
        {"attempts": [{**attempt, "reward": 0.5} for attempt in record["attempts"]]},
    ):
        assert not is_same_result(record, {**record, **changes})
