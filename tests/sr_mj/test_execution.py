from dataclasses import replace

import mujoco
import numpy as np
import pytest

from models.tabletop import BIN_CENTER, BIN_HALF_M
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.execution import Executor
from sr_mj.judge import object_in_gripper
from sr_mj.outcome import Reason
from sr_mj.planning import Phase, Planner
from sr_mj.scene import Goal, PlaceGoal, SceneConfig, make_scene
from sr_mj.scene.placement import find_object, place_region, touched_bodies


@pytest.fixture(scope="module")
def planner():
    return Planner()


@pytest.fixture
def banana_scene():
    return make_scene(SceneConfig(scene="single", objects=("banana",), seed=5))


@pytest.fixture
def plan_at(planner, pose_down):
    """Plans to grasp at a position, straight from above."""

    def make(position, yaw=0.0, width_m=0.05, shake_off=False):
        candidates = ActionCandidates(
            kind="pick",
            Ts_world_tool=pose_down(*position, yaw)[None],
            width_m=np.array([width_m], np.float32),
            prior=np.ones(1, np.float32),
        )
        plan = planner.plan(candidates, np.array([0]), shake_off=shake_off)
        assert plan is not None
        return plan

    return make


def place_plan_at(planner, scene, executor, xy, height_m):
    """Turn the tool upright over a point, and plan to let go at a height."""
    pose = np.eye(4)
    pose[:3, :3] = executor.T_world_grasp[:3, :3]
    pose[:3, 3] = [*xy, height_m]
    candidates = ActionCandidates(
        kind="place",
        Ts_world_tool=pose[None],
        width_m=np.array([executor.drive.width_m], np.float32),
        prior=np.ones(1, np.float32),
    )
    plan = planner.plan(candidates, np.array([0]), start=executor.drive.arm_qpos)
    assert plan is not None
    return plan


@pytest.fixture
def cube_scene():
    """A cube to put on or near a can, with five others about."""
    objects = ("block_cube", "tuna_can", "lemon", "banana", "apple", "plum", "red_bowl", "orange")
    scene = make_scene(SceneConfig(scene="place8", objects=objects, seed=2))
    return scene


def with_goal(scene, relation, reference="tuna_can", targets=("block_cube",)):
    place = PlaceGoal(relation=relation, references=(reference,))
    return replace(scene, goal=Goal(text="", targets=targets, place=place))


def grasp_cube(plan_at, scene, executor):
    item = find_object(scene, "block_cube")
    pose = scene.T_world_object("block_cube")
    yaw = np.arctan2(pose[1, 0], pose[0, 0])
    center = scene.data.xipos[item.body.body_id]
    return executor.execute(plan_at(center, yaw), keep_target=True)


def banana_grasp(scene):
    """A grasp across the middle of the banana, by ground truth."""
    item = scene.objects[0]
    pose = scene.T_world_object(item.name)
    points = item.asset.vertices @ pose[:3, :3].T + pose[:3, 3]
    middle = points[np.abs(item.asset.vertices[:, 0] - item.asset.center_of_mass[0]) < 0.01]
    along = pose[:3, 0]
    return middle.mean(axis=0), np.arctan2(along[1], along[0]) + np.pi / 2


def test_a_good_grasp_holds_and_ends_in_the_bin(plan_at, banana_scene):
    position, yaw = banana_grasp(banana_scene)
    outcome = Executor(banana_scene).execute(plan_at(position, yaw))
    assert outcome.reason is Reason.GRASPED_TARGET
    assert outcome.success and outcome.grasped == "banana"
    resting = banana_scene.data.xipos[banana_scene.objects[0].body.body_id]
    assert np.all(np.abs(resting[:2] - BIN_CENTER[:2]) < BIN_HALF_M)
    np.testing.assert_allclose(banana_scene.data.qpos[:6], HOME_QPOS, atol=5e-3)
    assert outcome.simulated_s == pytest.approx(
        outcome.num_steps * banana_scene.model.opt.timestep, abs=1e-3
    )


def test_closing_on_air_is_an_empty_close_and_moves_nothing(plan_at, banana_scene):
    before = banana_scene.T_world_object("banana")
    center = banana_scene.data.xipos[banana_scene.objects[0].body.body_id]
    away = np.array([0.3 if center[0] > 0.5 else 0.7, -0.18 if center[1] > 0 else 0.18, 0.05])
    outcome = Executor(banana_scene).execute(plan_at(away))
    assert outcome.reason is Reason.EMPTY_CLOSE and not outcome.success
    np.testing.assert_allclose(banana_scene.T_world_object("banana"), before, atol=2e-3)
    np.testing.assert_allclose(banana_scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_an_object_that_was_not_asked_for_is_no_success(plan_at):
    scene = make_scene(
        SceneConfig(scene="single", objects=("banana",), seed=5, goal="give me the violin")
    )
    position, yaw = banana_grasp(scene)
    outcome = Executor(scene).execute(plan_at(position, yaw))
    assert outcome.reason is Reason.GRASPED_OTHER
    assert not outcome.success and outcome.grasped == "banana"


def test_the_arm_tracks_its_trajectory_to_a_millimetre(planner, plan_at):
    scene = make_scene(SceneConfig(scene="empty"))
    plan = plan_at((0.5, 0.1, 0.06))
    errors = []

    def compare(scene):
        times = np.array([compare.step * scene.model.opt.timestep])
        trajectory = next(s for s in plan.segments if s.phase is Phase.TRANSIT).trajectory
        if times[0] <= trajectory.duration_s:
            wanted, _ = trajectory.sample(times)
            reached = planner.kinematics.tool_pose(scene.data.qpos[:6])
            error = reached[:3, 3] - planner.kinematics.tool_pose(wanted[0])[:3, 3]
            errors.append(np.linalg.norm(error))
        compare.step += 1

    compare.step = 1
    Executor(scene, on_step=compare).execute(plan)
    assert len(errors) > 300
    assert max(errors) < 5e-3
    assert errors[-1] < 1e-3


def test_an_obstacle_in_the_way_is_noticed(plan_at):
    scene = make_scene(
        SceneConfig(scene="single", objects=("box",), seed=1, goal="give me the box")
    )
    center = scene.data.xipos[scene.objects[0].body.body_id]
    # Nearly closed fingers come down on the middle of the box.
    outcome = Executor(scene).execute(plan_at((*center[:2], 0.025), width_m=0.0))
    assert outcome.reason is Reason.APPROACH_COLLISION
    assert not outcome.success
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_time_is_simulated_time(plan_at, banana_scene):
    position, yaw = banana_grasp(banana_scene)
    start = banana_scene.data.time
    steps = []
    outcome = Executor(banana_scene, on_step=lambda scene: steps.append(scene.data.time)).execute(
        plan_at(position, yaw)
    )
    assert len(steps) == outcome.num_steps
    assert steps[-1] - start == pytest.approx(outcome.simulated_s, abs=1e-3)
    assert np.all(np.diff(steps) > 0)


def test_execution_repeats_bit_for_bit(plan_at):
    results = []
    for _ in range(2):
        scene = make_scene(SceneConfig(scene="single", objects=("banana",), seed=5))
        position, yaw = banana_grasp(scene)
        Executor(scene).execute(plan_at(position, yaw))
        results.append(scene.data.qpos.tobytes())
    assert results[0] == results[1]


def test_a_target_to_be_placed_stays_in_the_gripper_over_the_bin(plan_at, cube_scene):
    scene = with_goal(cube_scene, "on")
    executor = Executor(scene)
    outcome = grasp_cube(plan_at, scene, executor)
    assert outcome.reason is Reason.GRASPED_TARGET and outcome.reward == 1
    assert object_in_gripper(scene) == "block_cube" and executor.drive.feels_object
    tool = executor.drive.T_world_tool[:3, 3]
    assert np.all(np.abs(tool[:2] - BIN_CENTER[:2]) < BIN_HALF_M)
    assert tool[2] > 0.2


def test_another_object_is_dropped_even_if_targets_are_kept(plan_at, cube_scene):
    scene = with_goal(cube_scene, "on", targets=("lemon",))
    outcome = grasp_cube(plan_at, scene, Executor(scene))
    assert outcome.reason is Reason.GRASPED_OTHER and -1 < outcome.reward < 0
    assert outcome.knocked_off == ()
    resting = scene.data.xipos[find_object(scene, "block_cube").body.body_id]
    assert np.all(np.abs(resting[:2] - BIN_CENTER[:2]) < BIN_HALF_M)


def test_places_on_an_object(planner, plan_at, cube_scene):
    scene = with_goal(cube_scene, "on")
    executor = Executor(scene)
    half = scene.data.xipos[find_object(scene, "block_cube").body.body_id][2]
    assert grasp_cube(plan_at, scene, executor).success
    can = scene.data.xipos[find_object(scene, "tuna_can").body.body_id]
    height = 2 * can[2] + half + 0.01
    outcome = executor.execute(place_plan_at(planner, scene, executor, can[:2], height))
    assert outcome.reason is Reason.PLACED and outcome.success
    assert (outcome.grasped, outcome.missed_m, outcome.reward) == ("block_cube", 0, 1)
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_what_touches_down_early_is_let_go_there(planner, plan_at, cube_scene):
    scene = with_goal(cube_scene, "on")
    executor = Executor(scene)
    half = scene.data.xipos[find_object(scene, "block_cube").body.body_id][2]
    assert grasp_cube(plan_at, scene, executor).success
    can = find_object(scene, "tuna_can").body.body_id
    before = scene.data.xipos[can].copy()
    # Three centimetres into the can.
    plan = place_plan_at(planner, scene, executor, before[:2], 2 * before[2] + half - 0.03)
    deepest = []
    executor.drive._on_step = lambda scene: deepest.append(scene.data.contact.dist.min(initial=0))
    outcome = executor.execute(plan)
    assert outcome.reason is Reason.PLACED
    np.testing.assert_allclose(scene.data.xipos[can], before, atol=5e-3)
    assert min(deepest) > -5e-3
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_what_is_in_the_way_down_is_a_collision(planner, plan_at, cube_scene):
    scene = with_goal(cube_scene, "near")
    executor = Executor(scene)
    half = scene.data.xipos[find_object(scene, "block_cube").body.body_id][2]
    assert grasp_cube(plan_at, scene, executor).success
    can = scene.data.xipos[find_object(scene, "tuna_can").body.body_id].copy()
    # As if nobody had seen the can: down to the table beside its edge, half of the cube over it.
    plan = place_plan_at(planner, scene, executor, (can[0] + 0.03, can[1]), half)
    outcome = executor.execute(plan)
    assert outcome.reason is Reason.APPROACH_COLLISION and not outcome.success
    assert outcome.grasped == "block_cube" and outcome.missed_m > 0
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_beside_is_not_on(planner, plan_at, cube_scene):
    scene = with_goal(cube_scene, "on")
    executor = Executor(scene)
    half = scene.data.xipos[find_object(scene, "block_cube").body.body_id][2]
    assert grasp_cube(plan_at, scene, executor).success
    near = place_region(scene, "near", "tuna_can", moved="block_cube", clearance_m=0.04)
    spot = near.sample(np.random.default_rng(0), 1)[0]
    outcome = executor.execute(place_plan_at(planner, scene, executor, spot, half + 0.005))
    assert outcome.reason is Reason.WRONG_REGION and not outcome.success
    assert 0.04 < outcome.missed_m < 0.16
    assert outcome.reward == pytest.approx(-outcome.missed_m / scene.workspace.diagonal_m, abs=1e-4)
    resting = scene.data.xipos[find_object(scene, "block_cube").body.body_id]
    # It was put down, not thrown.
    np.testing.assert_allclose(resting, [*spot, half], atol=3e-3)


def test_what_is_lost_on_the_way_was_not_placed(planner, plan_at, cube_scene):
    scene = with_goal(cube_scene, "near")
    executor = Executor(scene)
    assert grasp_cube(plan_at, scene, executor).success
    near = place_region(scene, "near", "tuna_can", moved="block_cube", clearance_m=0.04)
    spot = near.sample(np.random.default_rng(0), 1)[0]
    plan = place_plan_at(planner, scene, executor, spot, 0.05)
    body = find_object(scene, "block_cube").body

    def take_away(scene):
        if take_away.step == 200:
            scene.data.qpos[body.qpos][:3] = [0.15, -0.58, 0.1]
        take_away.step += 1

    take_away.step = 0
    executor.drive._on_step = take_away
    outcome = executor.execute(plan)
    assert outcome.reason is Reason.SLIPPED_CARRY and not outcome.success
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_an_object_lost_in_the_lift_is_felt(plan_at, banana_scene):
    position, yaw = banana_grasp(banana_scene)
    plan = plan_at(position, yaw)
    body = banana_scene.objects[0].body
    start = banana_scene.data.qpos[body.qpos].copy()

    def take_away(scene):
        # Pulled out of the fingers once it is 3 cm up.
        if not take_away.done and scene.data.qpos[body.qpos][2] > start[2] + 0.03:
            scene.data.qpos[body.qpos] = start
            scene.data.qvel[body.qvel] = 0
            take_away.done = True

    take_away.done = False
    executor = Executor(banana_scene, on_step=take_away)
    outcome = executor.execute(plan)
    assert outcome.reason is Reason.SLIPPED_LIFT and outcome.grasped is None
    assert not executor.drive.feels_object
    np.testing.assert_allclose(banana_scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_what_falls_off_the_table_meanwhile_is_counted(plan_at):
    scene = make_scene(SceneConfig(scene="place8", objects=(), seed=4, goal="give me the violin"))
    item = scene.objects[0]
    away = min(
        ((x, y) for x in np.linspace(0.32, 0.68, 7) for y in np.linspace(-0.18, 0.18, 7)),
        key=lambda xy: (
            -min(np.linalg.norm(scene.data.xipos[o.body.body_id][:2] - xy) for o in scene.objects)
        ),
    )

    def push(scene):
        if push.step == 10:
            scene.data.qpos[item.body.qpos][:3] = [1.2, 0, 0]
            scene.data.qvel[item.body.dof_adr + 2] = -0.01
            mujoco.mj_forward(scene.model, scene.data)
        push.step += 1

    push.step = 0
    outcome = Executor(scene, on_step=push).execute(plan_at((*away, 0.06)))
    assert outcome.reason is Reason.KNOCKED_OFF
    assert outcome.knocked_off == (item.name,) and not outcome.success


@pytest.mark.parametrize("shake_off", [False, True])
def test_what_lies_on_something_slides_off_into_the_bin(plan_at, shake_off):
    """A bottle of shampoo lies on the calculator, and would be put down with it."""
    scene = make_scene(SceneConfig(arrangement="pick-place-unseen-00"))
    executor = Executor(scene)
    plan = plan_at([0.5017, -0.2293, 0.0208], np.radians(30), 0.073, shake_off)
    outcome = executor.execute(plan, keep_target=True)
    assert outcome.reason is Reason.GRASPED_TARGET and outcome.grasped == "calculator"
    assert not outcome.knocked_off
    assert object_in_gripper(scene) == "calculator"
    executor.drive.hold(1.0)
    shampoo = scene.data.xipos[find_object(scene, "shampoo").body.body_id]
    assert np.abs(shampoo[:2] - BIN_CENTER[:2]).max() < BIN_HALF_M
    assert (shampoo[2] < 0.1) == shake_off
    assert (
        touched_bodies(scene, "calculator").isdisjoint({find_object(scene, "shampoo").body.body_id})
        == shake_off
    )
