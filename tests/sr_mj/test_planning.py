import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.tabletop import BIN_CENTER
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.planning import Phase, Planner, straight_poses


@pytest.fixture(scope="module")
def planner():
    return Planner()


def candidates(*poses, width_m=0.05):
    num = len(poses)
    return ActionCandidates(
        kind="pick",
        Ts_world_tool=np.array(poses).reshape(num, 4, 4),
        width_m=np.full(num, width_m, np.float32),
        prior=np.ones(num, np.float32),
    )


def pose_down(x, y, z, yaw=0.0):
    pose = np.eye(4)
    pose[:3, :3] = (Rotation.from_euler("z", yaw) * Rotation.from_euler("x", np.pi)).as_matrix()
    pose[:3, 3] = x, y, z
    return pose


REACHABLE, FAR = pose_down(0.5, 0.1, 0.05, 0.4), pose_down(1.6, 0, 0.1)


def test_phases_follow_each_other_without_a_jump(planner):
    plan = planner.plan(candidates(REACHABLE), np.array([0]))
    assert [segment.phase for segment in plan.segments] == list(Phase)
    moves = [s.trajectory for s in plan.segments if s.trajectory is not None]
    np.testing.assert_allclose(moves[0].start, HOME_QPOS)
    np.testing.assert_allclose(moves[-1].end, HOME_QPOS)
    for before, after in itertools.pairwise(moves):
        np.testing.assert_allclose(before.end, after.start, atol=1e-12)


def test_approach_is_straight_and_lift_is_vertical(planner):
    plan = planner.plan(candidates(REACHABLE), np.array([0]))
    by_phase = {segment.phase: segment for segment in plan.segments}
    approach = by_phase[Phase.APPROACH].trajectory
    path = np.array(
        [planner.kinematics.tool_pose(q)[:3, 3] for q in approach.path(np.linspace(0, 1, 60))]
    )
    close = path[:, 2] < 0.05 + planner.config.approach_m
    np.testing.assert_allclose(path[close][:, :2], np.tile([0.5, 0.1], (close.sum(), 1)), atol=2e-3)
    np.testing.assert_allclose(path[-1], REACHABLE[:3, 3], atol=1e-3)
    assert path[0][2] >= planner.config.transit_height_m - 1e-3
    lifted = planner.kinematics.tool_pose(by_phase[Phase.LIFT].trajectory.end)[:3, 3]
    np.testing.assert_allclose(lifted, [0.5, 0.1, 0.05 + planner.config.lift_m], atol=1e-3)


def test_releases_over_the_bin(planner):
    plan = planner.plan(candidates(REACHABLE), np.array([0]))
    carry = next(s for s in plan.segments if s.phase is Phase.CARRY)
    position = planner.kinematics.tool_pose(carry.trajectory.end)[:3, 3]
    np.testing.assert_allclose(position[:2], BIN_CENTER[:2], atol=1e-3)


def test_every_motion_keeps_the_limits(planner):
    plan = planner.plan(candidates(REACHABLE), np.array([0]))
    for segment in plan.segments:
        if segment.trajectory is None:
            continue
        _, qvel = segment.trajectory.sample(np.linspace(0, segment.trajectory.duration_s, 500))
        assert np.abs(qvel).max() <= planner.config.limits.speed + 1e-9


@pytest.mark.parametrize(("width_m", "opening"), [(0.03, 0.05), (0.08, 0.085)])
def test_opens_wider_than_the_contact_up_to_the_stroke(planner, width_m, opening):
    plan = planner.plan(candidates(REACHABLE, width_m=width_m), np.array([0]))
    assert plan.segments[0].width_m == pytest.approx(opening, abs=1e-6)


def test_takes_the_first_candidate_that_can_be_reached(planner):
    plan = planner.plan(candidates(FAR, REACHABLE, REACHABLE), np.array([0, 2, 1]))
    assert plan.chosen == 2


def test_nothing_reachable_is_no_plan(planner):
    assert planner.plan(candidates(FAR), np.array([0])) is None
    assert planner.plan(candidates(), np.array([], int)) is None


def test_straight_poses_are_evenly_spaced():
    end = pose_down(0.5, 0.1, 0.15, 1.0)
    poses = straight_poses(REACHABLE, end, 0.01)
    np.testing.assert_allclose(poses[0], REACHABLE, atol=1e-12)
    np.testing.assert_allclose(poses[-1], end, atol=1e-12)
    gaps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    assert gaps.max() <= 0.01 + 1e-9
    np.testing.assert_allclose(gaps, gaps[0])
