import json
import logging
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from models.arrangements.arrangement import ArrangedGoal, ArrangedObject, Arrangement, Pose
from models.arrangements.library import arrangement_names, load_arrangement
from models.arrangements.paraphrases import paraphrases
from sr_mj.errors import ConfigError, UnknownNameError
from sr_mj.scene import PlaceGoal, SceneConfig, make_scene, scene_config
from sr_mj.scene.arranged import describe, reproduce
from sr_mj.scene.layout import keeps_apart

PLACES = arrangement_names("place")


@pytest.mark.parametrize("name", arrangement_names("grasp")[::5] + PLACES[::10])
def test_dropping_the_objects_again_gives_the_same_bits(name):
    assert reproduce(SceneConfig(arrangement=name)) == ()


@pytest.mark.parametrize("name", ["grasp-seen-00", "grasp-unseen-04", "pick-place-seen-01"])
def test_objects_lie_where_the_file_says(name):
    scene = make_scene(SceneConfig(arrangement=name))
    arrangement = load_arrangement(name)
    assert [item.name for item in scene.objects] == [item.name for item in arrangement.objects]
    for item, arranged in zip(scene.objects, arrangement.objects, strict=True):
        stored = [*arranged.settled.position_m, *arranged.settled.quat_wxyz]
        assert scene.settled_qpos[item.body.qpos].tolist() == stored
    assert scene.goal.text == arrangement.goal.text
    assert scene.goal.targets == arrangement.goal.targets
    graspable = {item.name for item in scene.objects if item.graspable}
    assert graspable & set(scene.goal.targets) or name.startswith("grasp")


@pytest.mark.parametrize("name", arrangement_names()[::4])
def test_objects_stay_where_they_lie(name):
    scene = make_scene(SceneConfig(arrangement=name))
    mujoco.mj_step(scene.model, scene.data, 500)
    for item in scene.objects:
        moved = scene.data.qpos[item.body.qpos][:3] - scene.settled_qpos[item.body.qpos][:3]
        assert np.linalg.norm(moved) < 2e-3, item.name


@pytest.mark.parametrize("name", PLACES)
def test_place_arrangements_keep_their_distance(name):
    scene = make_scene(SceneConfig(arrangement=name))
    assert keeps_apart(scene.data, [item.body for item in scene.objects], 0.1)
    goal = load_arrangement(name).goal
    assert scene.goal.place == PlaceGoal(relation=goal.relation, references=goal.references)


def test_the_seed_changes_nothing():
    first, second = (make_scene(SceneConfig(arrangement=PLACES[0], seed=s)) for s in (0, 1))
    assert first.settled_qpos.tobytes() == second.settled_qpos.tobytes()
    assert first.goal == second.goal


def test_other_wordings_mean_the_same_objects():
    name = "grasp-seen-00"
    goal = load_arrangement(name).goal
    for text in (paraphrases(goal.text)[0], goal.text):
        scene = make_scene(SceneConfig(arrangement=name, goal=text))
        assert (scene.goal.text, scene.goal.targets) == (text, goal.targets)
    other = make_scene(SceneConfig(arrangement=name, goal="give me the violin"))
    assert other.goal.targets == ()


def test_another_version_of_mujoco_is_told_and_the_stored_poses_used(caplog):
    arrangement = load_arrangement("place-seen-00")
    shifted = arrangement.objects[0].settled
    x, y, z = shifted.position_m
    moved = replace(arrangement.objects[0], settled=replace(shifted, position_m=(x + 0.002, y, z)))
    old = replace(arrangement, mujoco="3.0.0", objects=(moved, *arrangement.objects[1:]))
    with caplog.at_level(logging.WARNING):
        scene = make_scene(SceneConfig(arrangement=old))
    assert [record.message for record in caplog.records] == [
        f"Arrangement 'place-seen-00': {moved.name} comes to lie 2.000 mm from its stored pose "
        f"(settled with mujoco 3.0.0, this is {mujoco.__version__}; the stored pose is used)."
    ]
    assert scene.settled_qpos[scene.objects[0].body.qpos][0] == x + 0.002


def test_an_object_of_another_shape_is_told_and_all_fall_anew():
    arrangement = load_arrangement("place-seen-00")
    other = replace(arrangement.objects[2], fingerprint="0" * 16)
    changed = replace(
        arrangement, objects=(*arrangement.objects[:2], other, *arrangement.objects[3:])
    )
    (difference,) = reproduce(SceneConfig(arrangement=changed))
    assert (difference.name, difference.is_changed) == (other.name, True)
    assert difference.moved_m == 0
    assert "has another shape or mass" in describe(changed, difference)


def test_an_arrangement_that_was_never_settled_is_dropped():
    def fallen(name, y):
        drop = Pose(position_m=(0.5, y, 0.2), quat_wxyz=(1.0, 0.0, 0.0, 0.0))
        return ArrangedObject(name=name, object="apple", drop=drop)

    case = Arrangement(
        name="two-apples",
        suite="case",
        split="seen",
        scene="cluttered15",
        goal=ArrangedGoal(text="give me the apple", targets=("apple_2",)),
        objects=(fallen("apple", -0.1), fallen("apple_2", 0.1)),
    )
    first, second = (make_scene(SceneConfig(arrangement=case, seed=4)) for _ in range(2))
    assert first.settled_qpos.tobytes() == second.settled_qpos.tobytes()
    assert [item.name for item in first.objects] == ["apple", "apple_2"]
    assert [item.asset.name for item in first.objects] == ["apple", "apple"]
    heights = [first.data.xipos[item.body.body_id][2] for item in first.objects]
    assert max(heights) < 0.06
    assert first.goal.targets == ("apple_2",)


def test_scenes_by_name():
    assert scene_config("grasp-unseen-01", split="seen").split == "unseen"
    assert scene_config("grasp-unseen-01").kind is scene_config("cluttered15").kind
    assert scene_config("place8", split="unseen", seed=3) == SceneConfig(
        scene="place8", split="unseen", seed=3
    )


@pytest.mark.parametrize(
    ("make", "error_type", "message"),
    [
        (lambda: SceneConfig(arrangement="grasp-seen-00", objects=("apple",)), ConfigError, "An arrangement brings its own objects; name one or the other."),
        (lambda: scene_config("grasp-sen-00"), UnknownNameError, "Unknown scene 'grasp-sen-00'. Scenes: cluttered15, place8, pickplace8, heavy30, single, empty, grasp-seen-00 to grasp-seen-09, grasp-unseen-00 to grasp-unseen-04, place-seen-00 to place-seen-19, place-unseen-00 to place-unseen-09, pick-place-seen-00 to pick-place-seen-07, pick-place-unseen-00 to pick-place-unseen-03, heavy30-seen-00 to heavy30-seen-02, heavy30-unseen-00 to heavy30-unseen-01. Did you mean 'grasp-seen-00'?"),
    ],
)  # fmt: skip
def test_bad_input(make, error_type, message):
    with pytest.raises(error_type) as error:
        make()
    assert str(error.value) == message


def test_an_arrangement_can_be_exported(tmp_path):
    from sr_mj.export import export_scene

    scene = make_scene(SceneConfig(arrangement="place-seen-03"))
    export_scene(scene, tmp_path / "out")
    about = json.loads((tmp_path / "out" / "scene.json").read_text())
    assert about["config"]["arrangement"] == "place-seen-03"
    assert about["place"] == {
        "relation": scene.goal.place.relation,
        "references": list(scene.goal.place.references),
    }
