import json
import re
from dataclasses import replace

import numpy as np
import pytest

from models.arrangements.arrangement import (
    ArrangedGoal,
    ArrangedObject,
    Arrangement,
    Pose,
    content_hash,
    instance_names,
    read_arrangement,
    to_record,
    write_arrangement,
)
from models.arrangements.library import (
    SUITES,
    arrangement_names,
    data_folder,
    load_arrangement,
    summary,
)
from models.arrangements.paraphrases import paraphrases, wordings
from models.errors import ArrangementError, UnknownNameError
from models.objects.catalogue import load_object, object_names
from models.objects.fingerprint import fingerprint, matches
from models.workspace import PICK_ZONE, PLACE_ZONE
from sr_mj.evaluation.published import TABLE_2

COUNTS = {
    ("grasp", "seen"): 10,
    ("grasp", "unseen"): 5,
    ("place", "seen"): 20,
    ("place", "unseen"): 10,
    ("pick-place", "seen"): 8,
    ("pick-place", "unseen"): 4,
    ("heavy30", "seen"): 3,
    ("heavy30", "unseen"): 2,
}
NUM_OBJECTS = {"grasp": 15, "place": 8, "pick-place": 8, "heavy30": 30}
TEMPLATES = re.compile(
    r"(give me the|I need a|grasp a|I want a|get something to|put it|place this|move the object)\b"
)
every_arrangement = pytest.mark.parametrize("name", arrangement_names())


def pose(x=0.5, y=0.0, z=0.1):
    return Pose(position_m=(x, y, z), quat_wxyz=(1.0, 0.0, 0.0, 0.0))


def small(**changes):
    objects = tuple(
        ArrangedObject(
            name=name, object="apple", drop=pose(y=y), settled=pose(), fingerprint="0" * 16
        )
        for name, y in (("apple", 0.1), ("apple_2", -0.1))
    )
    plain = {
        "name": "grasp-seen-77",
        "suite": "grasp",
        "split": "seen",
        "scene": "cluttered15",
        "goal": ArrangedGoal(text="give me the apple", targets=("apple",)),
        "objects": objects,
        "seed": 3,
        "mujoco": "3.17.0",
    }
    return Arrangement(**{**plain, **changes})


@pytest.mark.parametrize(("suite", "split"), COUNTS)
def test_every_suite_is_complete(suite, split):
    names = arrangement_names(suite, split)
    assert names == tuple(f"{suite}-{split}-{i:02d}" for i in range(COUNTS[suite, split]))


def test_nothing_else_lies_in_the_folder():
    assert set(SUITES) == {suite for suite, _ in COUNTS}
    assert len(arrangement_names()) == sum(COUNTS.values()) == len(list(data_folder().iterdir()))


@every_arrangement
def test_content(name):
    arrangement = load_arrangement(name)
    assert arrangement.name == name
    assert name.startswith(f"{arrangement.suite}-{arrangement.split}-")
    assert len(arrangement.objects) == NUM_OBJECTS[arrangement.suite]
    assert arrangement.is_settled
    objects = [item.object for item in arrangement.objects]
    assert set(objects) <= set(object_names(arrangement.split))
    assert len(set(objects)) == len(objects)
    assert (arrangement.goal.relation is not None) == (arrangement.suite.endswith("place"))
    assert (len(arrangement.goal.references) == 1) == (arrangement.suite.endswith("place"))
    assert not set(arrangement.goal.targets) & set(arrangement.goal.references)


@every_arrangement
def test_objects_are_those_it_was_settled_with(name):
    for item in load_arrangement(name).objects:
        assert matches(load_object(item.object), item.fingerprint), item.name


def test_arrangements_differ():
    drops = [item.drop for name in arrangement_names() for item in load_arrangement(name).objects]
    assert len(set(drops)) == len(drops)


def test_the_seen_grasp_goals_are_those_of_the_papers_table_2():
    goals = [load_arrangement(name).goal for name in arrangement_names("grasp", "seen")]
    of_the_paper = {text.lower().replace("_", " ") for text in TABLE_2}
    assert {goal.text.lower() for goal in goals} == of_the_paper
    assert all(1 <= len(goal.targets) <= 3 for goal in goals)


def test_place_goals_cover_inside_and_outside_relations():
    for split in ("seen", "unseen"):
        relations = {
            load_arrangement(name).goal.relation for name in arrangement_names("place", split)
        }
        assert len(relations) >= 8


def test_each_goal_has_five_wordings_that_no_template_makes():
    for name in arrangement_names():
        goal = load_arrangement(name).goal.text
        others = paraphrases(goal)
        assert len(set(others)) == len(others) >= 5
        assert not [text for text in others if TEMPLATES.match(text)]
        assert wordings(goal) == (goal, *others)


@pytest.mark.parametrize("name", [n for n in arrangement_names() if n.startswith("pick-place")])
def test_each_zone_has_what_its_phase_asks_for(name):
    arrangement = load_arrangement(name)
    at = {item.name: item.settled.position_m for item in arrangement.objects}
    assert PICK_ZONE.contains_xy([at[target] for target in arrangement.goal.targets]).all()
    assert PLACE_ZONE.contains_xy([at[name] for name in arrangement.goal.references]).all()


def test_fingerprints_ignore_the_sign_of_zeros_and_nothing_else():
    asset = load_object("soap_dish")
    assert (asset.inertia[0, 1], asset.inertia[1, 2]) == (0, 0)
    turned = np.array(asset.inertia)
    turned[0, 1] = turned[1, 0] = -0.0
    turned = replace(asset, inertia=turned)
    assert fingerprint(turned) == fingerprint(asset)
    # Hashed as it is, by an earlier version.
    assert matches(asset, "2b68a8b7333cc1c9") and matches(asset, "b33b524c6828e034")
    heavier = np.array(asset.inertia)
    heavier[0, 0] = np.nextafter(heavier[0, 0], 1)
    assert not matches(replace(asset, inertia=heavier), fingerprint(asset))
    shifted = replace(asset, vertices=asset.vertices + 1e-5)
    assert not matches(shifted, fingerprint(asset))


def test_a_goal_without_other_wordings():
    assert paraphrases("give me the violin") == ()


def test_written_and_read_back(tmp_path):
    arrangement = small()
    write_arrangement(arrangement, tmp_path / "a.json")
    assert read_arrangement(tmp_path / "a.json") == arrangement
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_the_hash_ignores_order_and_space_but_no_digit(tmp_path):
    record = to_record(small())
    shuffled = dict(reversed(record.items()))
    (tmp_path / "a.json").write_text(json.dumps(shuffled, indent=7))
    assert read_arrangement(tmp_path / "a.json") == small()
    nudged = json.loads(json.dumps(record))
    nudged["objects"][1]["settled"]["position_m"][0] += 1e-15
    assert content_hash(nudged) != record["sha256"]


def test_repeated_objects_are_numbered():
    names = instance_names(["apple", "lemon", "apple", "apple_2", "apple"])
    assert names == ("apple", "lemon", "apple_3", "apple_2", "apple_4")


def changed(path, **changes):
    record = {**to_record(small()), **changes}
    path.write_text(json.dumps({**record, "sha256": content_hash(record)}))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 2}, "format: 1 was expected."),
        ({"suite": "grab"}, "suite: 'grab' is not one of ['grasp', 'place', 'pick-place', 'heavy30']."),
        ({"objects": []}, "objects: [] should be non-empty."),
        ({"goal": {"text": " ", "targets": ["apple"], "relation": None, "references": []}}, r"goal.text: ' ' does not match '\\S'."),
        ({"extra": 1}, "the whole document: Additional properties are not allowed ('extra' was unexpected)."),
    ],
)  # fmt: skip
def test_files_that_break_the_schema(tmp_path, changes, message):
    path = tmp_path / "bad.json"
    changed(path, **changes)
    with pytest.raises(ArrangementError) as error:
        read_arrangement(path)
    assert str(error.value) == f"{path}: {message}"


def test_a_file_changed_by_hand(tmp_path):
    path = tmp_path / "bad.json"
    record = to_record(small())
    record["goal"]["text"] = "give me the lemon"
    path.write_text(json.dumps(record))
    with pytest.raises(ArrangementError) as error:
        read_arrangement(path)
    assert str(error.value) == (
        f"{path}: its content hashes to {content_hash(record)[:12]}..., the file says "
        f"{record['sha256'][:12]}...; it was changed by hand. Restore it, or make it anew."
    )


@pytest.mark.parametrize("content", ["", "{", "\x00"])
def test_files_that_are_no_json(tmp_path, content):
    (tmp_path / "bad.json").write_text(content)
    with pytest.raises(ArrangementError, match=r"^Cannot read arrangement '.*bad.json': "):
        read_arrangement(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("make", "error_type", "message"),
    [
        (lambda: small(objects=small().objects[:1] * 2), ArrangementError, "Arrangement 'grasp-seen-77' has two objects called 'apple'; number them."),
        (lambda: small(goal=ArrangedGoal(text="x", targets=("pear",))), ArrangementError, "The goal of arrangement 'grasp-seen-77' speaks of 'pear'; its objects are apple, apple_2."),
        (lambda: load_arrangement("grasp-seen-99"), UnknownNameError, f"Unknown arrangement 'grasp-seen-99'. Arrangements: {summary()}. Did you mean 'grasp-seen-09'?"),
    ],
)  # fmt: skip
def test_bad_input(make, error_type, message):
    with pytest.raises(error_type) as error:
        make()
    assert str(error.value) == message


def test_summary():
    assert summary().startswith("grasp-seen-00 to grasp-seen-09, grasp-unseen-00 to ")
