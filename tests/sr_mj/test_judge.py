from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sr_mj.judge import Judge, object_in_gripper, touching_fingers
from sr_mj.outcome import Reason
from sr_mj.scene import Goal, PlaceGoal, SceneConfig, make_scene
from sr_mj.scene.placement import find_object, is_placed, place_region

OBJECTS = ("red_bowl", "lemon", "banana", "orange", "apple", "block_cube", "plum", "tuna_can")


@pytest.fixture
def scene():
    made = make_scene(SceneConfig(scene="place8", objects=OBJECTS, seed=3, goal="give me the plum"))
    place = PlaceGoal(relation="on", references=("tuna_can",))
    return replace(made, goal=replace(made.goal, place=place))


def center(scene, name):
    return scene.data.xipos[find_object(scene, name).body.body_id].copy()


def put(scene, name, position, turn=None, seconds=2.0):
    """Let go of an object, its centre of mass at a position, and wait."""
    body = find_object(scene, name).body
    qpos = scene.data.qpos[body.qpos]
    if turn is not None:
        before = Rotation.from_quat(qpos[3:], scalar_first=True)
        qpos[3:] = (turn * before).as_quat(scalar_first=True)
        mujoco.mj_forward(scene.model, scene.data)
    qpos[:3] += np.subtract(position, center(scene, name))
    scene.data.qvel[body.dof_adr + 2] = -0.01
    mujoco.mj_step(scene.model, scene.data, round(seconds / scene.model.opt.timestep))


def above(scene, name, height):
    return np.add(center(scene, name), [0, 0, height])


def judge_of_placing(scene, moved):
    judge = Judge(scene)
    judge.begin_place(moved)
    judge.begin_release(moved)
    return judge


def test_a_cube_on_a_can_is_placed(scene):
    judge = judge_of_placing(scene, "block_cube")
    put(scene, "block_cube", above(scene, "tuna_can", 0.06))
    assert judge.is_calm() and judge.is_calm("block_cube")
    assert judge.place_reason("block_cube") is Reason.PLACED
    assert judge.missed_m("block_cube") == 0


def test_beside_the_can_is_the_wrong_region(scene):
    judge = judge_of_placing(scene, "block_cube")
    assert judge.place_reason("block_cube") is Reason.WRONG_REGION
    gap = np.linalg.norm((center(scene, "block_cube") - center(scene, "tuna_can"))[:2])
    assert 0.02 < judge.missed_m("block_cube") < gap


def test_what_fell_over_has_toppled(scene):
    judge = judge_of_placing(scene, "tuna_can")
    put(scene, "tuna_can", above(scene, "tuna_can", 0.04), Rotation.from_euler("x", 80, True))
    assert judge.place_reason("tuna_can") is Reason.TOPPLED


def test_a_turn_about_the_vertical_is_no_topple(scene):
    judge = judge_of_placing(scene, "tuna_can")
    put(scene, "tuna_can", above(scene, "tuna_can", 0.02), Rotation.from_euler("z", 90, True))
    assert judge.place_reason("tuna_can") is Reason.WRONG_REGION


def test_what_leaves_the_table_was_knocked_off(scene):
    judge = judge_of_placing(scene, "block_cube")
    put(scene, "block_cube", (0.2, 0.0, 0.04))
    put(scene, "plum", (1.3, 0.0, 0.04))
    assert judge.place_reason("block_cube") is Reason.KNOCKED_OFF
    assert judge.knocked_off("block_cube") == ("plum",)
    assert set(judge.knocked_off(None)) == {"block_cube", "plum"}
    # They are gone already when the next attempt begins.
    assert Judge(scene).knocked_off(None) == ()


def test_what_lies_where_it_should_but_outside_the_workspace_was_knocked_off(scene):
    edge = scene.workspace.upper[0]
    place = PlaceGoal(relation="near", references=("tuna_can",))
    scene = replace(scene, goal=replace(scene.goal, place=place))
    put(scene, "tuna_can", (edge - 0.07, 0.1, 0.04))
    judge = judge_of_placing(scene, "block_cube")
    put(scene, "block_cube", (edge + 0.05, 0.1, 0.04))
    region = place_region(scene, "near", "tuna_can", moved="block_cube")
    assert is_placed(scene, "block_cube", region)
    assert judge.place_reason("block_cube") is Reason.KNOCKED_OFF
    assert judge.missed_m("block_cube") > 0


def test_what_lies_in_the_bin_was_not_knocked_off(scene):
    judge = Judge(scene)
    put(scene, "plum", (0.15, -0.58, 0.05))
    assert judge.knocked_off(None) == ()


def test_what_still_moves_has_timed_out(scene):
    judge = judge_of_placing(scene, "plum")
    body = find_object(scene, "plum").body
    scene.data.qvel[body.dof_adr] = 0.1
    assert not judge.is_calm() and not judge.is_calm("plum") and judge.is_calm("tuna_can")
    assert judge.place_reason("plum") is Reason.TIMED_OUT


def test_what_still_moves_where_it_should_be_is_not_placed(scene):
    judge = judge_of_placing(scene, "block_cube")
    put(scene, "block_cube", above(scene, "tuna_can", 0.06))
    assert judge.place_reason("block_cube") is Reason.PLACED
    scene.data.qvel[find_object(scene, "block_cube").body.dof_adr] = 0.1
    assert is_placed(scene, "block_cube", place_region(scene, "on", "tuna_can", moved="block_cube"))
    assert judge.place_reason("block_cube") is Reason.TIMED_OUT
    assert judge.missed_m("block_cube") == 1e-3


def test_the_nearest_object_that_rose_was_lifted(scene):
    judge = Judge(scene)
    assert judge.lifted_object(0.05) is None
    put(scene, "plum", (0.5, 0.0, 0.3), seconds=0.002)
    put(scene, "apple", (0.7, 0.2, 0.35), seconds=0.002)
    tool = scene.data.site("ur5/gripper/tool").xpos
    gaps = {name: np.linalg.norm(center(scene, name) - tool) for name in ("plum", "apple")}
    assert judge.lifted_object(0.05) == min(gaps, key=gaps.get)


def test_what_the_fingers_hold_was_lifted_and_not_what_lies_nearer(scene):
    scene = replace(scene, goal=Goal(text="give me the apple", targets=("apple",)))
    judge = Judge(scene)
    tool = scene.data.site("ur5/gripper/tool")
    closing = tool.xmat.reshape(3, 3)[:, 0].copy()
    for name, shift in (("apple", -0.045), ("plum", 0.034)):
        put(scene, name, tool.xpos + shift * closing, seconds=0)
    mujoco.mj_forward(scene.model, scene.data)
    gaps = [np.linalg.norm(judge.position_in_tool(name)) for name in ("plum", "apple")]
    assert gaps == sorted(gaps)
    assert judge.lifted_object(0.05) == "apple"
    # What the fingers hold, but did not raise, is not lifted.
    later = Judge(scene)
    assert later.lifted_object(0.05) is None
    put(scene, "tuna_can", above(scene, "tuna_can", 0.3), seconds=0)
    mujoco.mj_forward(scene.model, scene.data)
    assert object_in_gripper(scene) == "apple" and later.lifted_object(0.05) == "tuna_can"


def test_reward_falls_with_the_distance_to_the_target(scene):
    judge = Judge(scene)
    plum = center(scene, "plum")
    rewards = [judge.grasp_reward(np.add(plum, [0, 0, height])) for height in (0.04, 0.1, 0.2, 9.0)]
    assert 0 > rewards[0] > rewards[1] > rewards[2] > rewards[3] == -1
    step = (rewards[1] - rewards[2]) * scene.workspace.diagonal_m
    assert step == pytest.approx(0.1, abs=2e-3)
    aimless = replace(scene, goal=Goal(text="a violin", targets=()))
    assert Judge(aimless).grasp_reward(plum) == -1


def test_nothing_is_in_the_open_gripper(scene):
    assert object_in_gripper(scene) is None


def test_of_two_objects_between_the_fingers_the_one_asked_for_is_held(scene):
    tool = scene.data.site("ur5/gripper/tool")
    closing = tool.xmat.reshape(3, 3)[:, 0].copy()
    # Each overlaps the outer side of one finger; the plum is nearer.
    for name, shift in (("apple", -0.045), ("plum", 0.034)):
        put(scene, name, tool.xpos + shift * closing, seconds=0)
        mujoco.mj_forward(scene.model, scene.data)
        fingers = touching_fingers(scene)
        assert len(fingers[name]) == 1
        assert (object_in_gripper(scene) is None) == (len(fingers) == 1)
    for targets, name in ((("plum",), "plum"), (("apple",), "apple"), ((), "plum")):
        goal = Goal(text="what is asked for", targets=targets)
        assert object_in_gripper(replace(scene, goal=goal)) == name
