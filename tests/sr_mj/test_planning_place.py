import itertools

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.tabletop import BIN_CENTER, BIN_HALF_M, BIN_HEIGHT_M
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.candidates.held import HeldObject
from sr_mj.kinematics import build_planning_model
from sr_mj.planning import PLACE_PHASES, Phase, Planner
from sr_mj.planning.body import RobotBody
from sr_mj.planning.clearance import Clearance
from sr_mj.planning.motion import Connector
from sr_mj.trajectory import fit_path


def places(*poses, width_m=0.04):
    num = len(poses)
    return ActionCandidates(
        kind="place",
        Ts_world_tool=np.array(poses).reshape(num, 4, 4),
        width_m=np.full(num, width_m, np.float32),
        prior=np.ones(num, np.float32),
    )


FIRST = np.array([0])


@pytest.fixture(scope="module")
def held_box(block, pose_down):
    """Makes boxes that hang below the tool, grasped at their top."""

    def make(length_m=0.06, half_m=0.02):
        low, high = (-half_m, -half_m, -0.01), (half_m, half_m, length_m)
        return HeldObject(
            points_tool=block(low, high),
            drop_m=length_m,
            T_world_tool=pose_down(0.4, 0.0, length_m),
            width_m=2 * half_m,
        )

    return make


@pytest.fixture(scope="module")
def box(held_box):
    return held_box()


@pytest.fixture(scope="module")
def goal(pose_down):
    """Where to let go of the box, which then stands 5 mm over the table."""
    return pose_down(0.5, 0.05, 0.065, 0.7)


@pytest.fixture(scope="module")
def planner():
    return Planner()


@pytest.fixture(scope="module")
def start(planner):
    """A posture over the bin, with something in the gripper."""
    return planner.postures_over_bin[0]


def test_phases_follow_each_other_from_the_start_to_home(planner, start, box, goal):
    plan = planner.plan(places(goal), FIRST, held=box, start=start)
    assert plan.kind == "place" and plan.chosen == 0
    np.testing.assert_array_equal(plan.T_world_tool, goal)
    assert tuple(segment.phase for segment in plan.segments) == PLACE_PHASES
    moves = [s.trajectory for s in plan.segments if s.trajectory is not None]
    np.testing.assert_allclose(moves[0].start, start)
    np.testing.assert_allclose(moves[-1].end, HOME_QPOS)
    # Lower ends where retreat begins: the gripper opens there.
    for before, after in itertools.pairwise(moves):
        np.testing.assert_allclose(before.end, after.start, atol=1e-12)


def test_holds_on_until_the_place_and_opens_a_little_there(planner, start, box, goal):
    plan = planner.plan(places(goal), FIRST, held=box, start=start)
    widths = {segment.phase: segment.width_m for segment in plan.segments}
    assert widths[Phase.TRANSIT] == widths[Phase.LOWER] == 0
    assert widths[Phase.RELEASE] == pytest.approx(box.width_m + planner.config.extra_width_m)


def test_lowers_straight_down_to_the_very_pose(planner, start, box, goal):
    plan = planner.plan(places(goal), FIRST, held=box, start=start)
    lower = next(s.trajectory for s in plan.segments if s.phase is Phase.LOWER)
    poses = np.array([planner.kinematics.tool_pose(q) for q in lower.path(np.linspace(0, 1, 50))])
    np.testing.assert_allclose(poses[-1], goal, atol=3e-3)
    # Not turned by half a turn either: the object would lie the other way round.
    np.testing.assert_allclose(poses[:, :3, :3], np.tile(goal[:3, :3], (50, 1, 1)), atol=5e-3)
    np.testing.assert_allclose(poses[:, :2, 3], np.tile(goal[:2, 3], (50, 1)), atol=2e-3)
    assert np.all(np.diff(poses[:, 2, 3]) < 1e-4)


def test_retreats_back_along_a_tilted_tool(planner, start, box, goal):
    tilted = goal.copy()
    tilted[:3, :3] = goal[:3, :3] @ Rotation.from_euler("x", -0.5).as_matrix()
    plan = planner.plan(places(tilted), FIRST, held=box, start=start)
    retreat = next(s.trajectory for s in plan.segments if s.phase is Phase.RETREAT)
    ends = [planner.kinematics.tool_pose(q)[:3, 3] for q in (retreat.start, retreat.end)]
    expected = -planner.config.approach_m * tilted[:3, 2]
    np.testing.assert_allclose(ends[1] - ends[0], expected, atol=2e-3)


def test_a_held_object_counts_on_the_way_down(planner, start, box, goal, block):
    # Beside the gripper, but where the held box would come down; lower than where it may touch.
    neighbour = block((0.495, 0.045, 0.01), (0.505, 0.055, 0.05))
    assert planner.plan(places(goal), FIRST, obstacles=neighbour, start=start) is not None
    assert planner.plan(places(goal), FIRST, obstacles=neighbour, held=box, start=start) is None


def test_a_held_object_may_touch_what_it_is_put_on(planner, start, box, goal, block):
    support = block((0.44, -0.01, 0.01), (0.56, 0.11, 0.03))
    on_top = goal.copy()
    on_top[2, 3] = 0.03 + box.drop_m + 0.003
    plan = planner.plan(places(on_top), FIRST, obstacles=support, held=box, start=start)
    assert plan is not None
    too_low = goal.copy()
    too_low[2, 3] = 0.03 + box.drop_m - 0.03
    assert planner.plan(places(too_low), FIRST, obstacles=support, held=box, start=start) is None


def test_a_held_object_does_not_sink_into_the_table(planner, start, box, pose_down):
    sunk = pose_down(0.5, 0.05, 0.03)
    assert planner.plan(places(sunk), FIRST, held=box, start=start) is None


def test_goes_on_to_the_next_place(planner, start, box, goal, pose_down):
    far = pose_down(1.4, 0, 0.1)
    sunk = pose_down(0.5, 0.05, 0.03)
    plan = planner.plan(places(far, sunk, goal), np.array([1, 0, 2]), held=box, start=start)
    assert plan.chosen == 2
    np.testing.assert_array_equal(planner.reachable(places(far, goal)), [False, True])


def test_the_transit_keeps_the_held_object_clear(planner, start, pose_down, block, held_box):
    wall = block((0.3, -0.2, 0.01), (0.75, -0.185, 0.24))
    long = held_box(length_m=0.15)
    place = pose_down(0.5, 0.05, 0.155)
    plan = planner.plan(places(place), FIRST, obstacles=wall, held=long, start=start)
    transit = next(s.trajectory for s in plan.segments if s.phase is Phase.TRANSIT)
    for qpos in transit.path(np.linspace(0, 1, 100)):
        pose = planner.kinematics.tool_pose(qpos)
        points = long.points_tool @ pose[:3, :3].T + pose[:3, 3]
        gaps = np.linalg.norm(wall[::4, None] - points[::4], axis=2)
        assert gaps.min() > 0.004


def test_a_held_object_keeps_clear_of_the_arm(planner, start):
    body = RobotBody()
    placed = body.place(start[None])
    # A rod from the tool to the middle of the forearm, as what was held would have to be.
    elbow = placed.centers[0, np.flatnonzero(body.is_far)[20]]
    pose = planner.kinematics.tool_pose(start)
    rod = np.linspace(0, 1, 60)[:, None] * ((elbow - pose[:3, 3]) @ pose[:3, :3])
    short = Clearance(body=body, held_points=rod[:20]).measure(start[None])
    # Over the bin the tool is higher than 20 cm, and the forearm is higher still.
    assert short[0] > 0.05
    touching = Clearance(body=body, held_points=rod).measure(start[None])
    assert touching[0] == pytest.approx(-body.radius_m[body.is_far][20] - 0.006, abs=2e-3)


def test_a_long_object_is_lifted_over_the_wall_of_the_bin(planner, start, pose_down, held_box):
    long = held_box(length_m=0.235)
    plan = planner.plan(places(pose_down(0.5, 0.05, 0.24)), FIRST, held=long, start=start)
    transit = next(s.trajectory for s in plan.segments if s.phase is Phase.TRANSIT)
    for qpos in transit.path(np.linspace(0, 1, 100)):
        pose = planner.kinematics.tool_pose(qpos)
        points = long.points_tool @ pose[:3, :3].T + pose[:3, 3]
        beside = np.abs(points[:, :2] - BIN_CENTER[:2]).max(axis=1) - BIN_HALF_M
        assert points[np.abs(beside) < 0.005, 2].min(initial=1.0) > BIN_HEIGHT_M - 0.005


def test_the_gripper_keeps_clear_of_the_forearm(planner, start):
    # Straight in the joints, the wrist would turn the palm 0.9 mm into the forearm on the way.
    goal = np.array([-2.70, -1.23, -1.69, -1.79, -4.71, 0.70])
    motions = Connector(config=planner.config, searches_left=1)
    path = motions.connect(start, goal, Clearance(body=RobotBody()))
    assert path.is_searched
    model = build_planning_model()
    data = mujoco.MjData(model)
    forearm = int(model.body("ur5/forearm_link").geomadr[0]) + 1
    assert model.geom(forearm).type == mujoco.mjtGeom.mjGEOM_CAPSULE
    palm = model.ngeom - 1

    def least_gap(postures):
        gaps = []
        for data.qpos[:] in postures:
            mujoco.mj_kinematics(model, data)
            gaps.append(mujoco.mj_geomDistance(model, data, forearm, palm, 0.3, None))
        return min(gaps)

    along = np.linspace(0, 1, 300)
    assert -0.001 < least_gap(start + along[:, None] * (goal - start)) < 0
    assert least_gap(fit_path(path.waypoints)(along)) > 0.0045
