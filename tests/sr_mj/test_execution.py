import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.tabletop import BIN_CENTER, BIN_HALF_M
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.execution import Executor
from sr_mj.outcome import Reason
from sr_mj.planning import Phase, Planner
from sr_mj.scene import SceneConfig, make_scene


@pytest.fixture(scope="module")
def planner():
    return Planner()


@pytest.fixture
def banana_scene():
    return make_scene(SceneConfig(scene="single", objects=("banana",), seed=5))


def plan_at(planner, position, yaw=0.0, width_m=0.05):
    pose = np.eye(4)
    pose[:3, :3] = (Rotation.from_euler("z", yaw) * Rotation.from_euler("x", np.pi)).as_matrix()
    pose[:3, 3] = position
    candidates = ActionCandidates(
        kind="pick",
        Ts_world_tool=pose[None],
        width_m=np.array([width_m], np.float32),
        prior=np.ones(1, np.float32),
    )
    plan = planner.plan(candidates, np.array([0]))
    assert plan is not None
    return plan


def banana_grasp(scene):
    """A grasp across the middle of the banana, by ground truth."""
    item = scene.objects[0]
    pose = scene.T_world_object(item.name)
    points = item.asset.vertices @ pose[:3, :3].T + pose[:3, 3]
    middle = points[np.abs(item.asset.vertices[:, 0] - item.asset.center_of_mass[0]) < 0.01]
    along = pose[:3, 0]
    return middle.mean(axis=0), np.arctan2(along[1], along[0]) + np.pi / 2


def test_a_good_grasp_holds_and_ends_in_the_bin(planner, banana_scene):
    position, yaw = banana_grasp(banana_scene)
    outcome = Executor(banana_scene).execute(plan_at(planner, position, yaw))
    assert outcome.reason is Reason.GRASPED_TARGET
    assert outcome.success and outcome.grasped == "banana"
    resting = banana_scene.data.xipos[banana_scene.objects[0].body.body_id]
    assert np.all(np.abs(resting[:2] - BIN_CENTER[:2]) < BIN_HALF_M)
    np.testing.assert_allclose(banana_scene.data.qpos[:6], HOME_QPOS, atol=5e-3)
    assert outcome.simulated_s == pytest.approx(
        outcome.num_steps * banana_scene.model.opt.timestep, abs=1e-3
    )


def test_closing_on_air_is_an_empty_close_and_moves_nothing(planner, banana_scene):
    before = banana_scene.T_world_object("banana")
    center = banana_scene.data.xipos[banana_scene.objects[0].body.body_id]
    away = np.array([0.3 if center[0] > 0.5 else 0.7, -0.18 if center[1] > 0 else 0.18, 0.05])
    outcome = Executor(banana_scene).execute(plan_at(planner, away))
    assert outcome.reason is Reason.EMPTY_CLOSE and not outcome.success
    np.testing.assert_allclose(banana_scene.T_world_object("banana"), before, atol=2e-3)
    np.testing.assert_allclose(banana_scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_an_object_that_was_not_asked_for_is_no_success(planner):
    scene = make_scene(
        SceneConfig(scene="single", objects=("banana",), seed=5, goal="give me the violin")
    )
    position, yaw = banana_grasp(scene)
    outcome = Executor(scene).execute(plan_at(planner, position, yaw))
    assert outcome.reason is Reason.GRASPED_OTHER
    assert not outcome.success and outcome.grasped == "banana"


def test_the_arm_tracks_its_trajectory_to_a_millimetre(planner):
    scene = make_scene(SceneConfig(scene="empty"))
    plan = plan_at(planner, (0.5, 0.1, 0.06))
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


def test_an_obstacle_in_the_way_is_noticed(planner):
    scene = make_scene(
        SceneConfig(scene="single", objects=("box",), seed=1, goal="give me the box")
    )
    center = scene.data.xipos[scene.objects[0].body.body_id]
    # Nearly closed fingers come down on the middle of the box.
    outcome = Executor(scene).execute(plan_at(planner, (*center[:2], 0.025), width_m=0.0))
    assert outcome.reason is Reason.APPROACH_COLLISION
    assert not outcome.success
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)


def test_time_is_simulated_time(planner, banana_scene):
    position, yaw = banana_grasp(banana_scene)
    start = banana_scene.data.time
    steps = []
    outcome = Executor(banana_scene, on_step=lambda scene: steps.append(scene.data.time)).execute(
        plan_at(planner, position, yaw)
    )
    assert len(steps) == outcome.num_steps
    assert steps[-1] - start == pytest.approx(outcome.simulated_s, abs=1e-3)
    assert np.all(np.diff(steps) > 0)


def test_execution_repeats_bit_for_bit(planner):
    results = []
    for _ in range(2):
        scene = make_scene(SceneConfig(scene="single", objects=("banana",), seed=5))
        position, yaw = banana_grasp(scene)
        Executor(scene).execute(plan_at(planner, position, yaw))
        results.append(scene.data.qpos.tobytes())
    assert results[0] == results[1]
