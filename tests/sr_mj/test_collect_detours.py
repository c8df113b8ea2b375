"""Which candidates the straight joint motion does not lead to."""

import numpy as np
import pytest

from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.candidates.held import HeldObject
from sr_mj.collecting.detours import needs_detour
from sr_mj.planning.body import RobotBody
from sr_mj.planning.config import PlannerConfig

FAR = np.array([[0.7, 0.2, 0.03]])


@pytest.fixture(scope="module")
def body():
    return RobotBody()


def candidates(poses, kind="pick"):
    num = len(poses)
    return ActionCandidates(
        kind=kind, Ts_world_tool=np.array(poses), width_m=np.full(num, 0.04), prior=np.ones(num)
    )


def detours(body, poses, obstacles, kind="pick", held=None):
    return needs_detour(
        candidates(poses, kind), PlannerConfig(), body, obstacles, np.array(HOME_QPOS), held
    )


def test_nothing_is_in_the_way_over_a_free_table(body, pose_down):
    poses = [pose_down(x, y, 0.03) for x in (0.4, 0.5, 0.6) for y in (-0.15, 0.0, 0.15)]
    found = detours(body, poses, FAR)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, np.zeros(9))


def test_a_wall_on_the_way_needs_a_detour(body, pose_down, block):
    ends = [pose_down(0.5, y, 0.03) for y in (-0.2, 0.2)]
    # Walls on either side of the middle, as high as the arm comes: one end is behind each.
    left = block((0.4, 0.09, 0.0), (0.6, 0.12, 0.5))
    right = block((0.4, -0.12, 0.0), (0.6, -0.09, 0.5))
    either = [detours(body, ends, wall) for wall in (left, right)]
    assert any(verdict.sum() == 1 for verdict in either)
    assert detours(body, ends, np.concatenate([left, right])).sum() >= 1


def test_the_order_of_candidates_does_not_matter(body, pose_down, block):
    rng = np.random.default_rng(0)
    poses = [pose_down(*rng.uniform((0.35, -0.2, 0.03), (0.65, 0.2, 0.1))) for _ in range(24)]
    wall = block((0.4, 0.05, 0.0), (0.6, 0.08, 0.35))
    found = detours(body, poses, wall)
    order = rng.permutation(24)
    np.testing.assert_array_equal(detours(body, [poses[i] for i in order], wall), found[order])
    assert 0 < found.sum() < 24


def test_a_grasp_is_the_same_turned_by_half_a_turn(body, pose_down, block):
    wall = block((0.4, 0.05, 0.0), (0.6, 0.08, 0.35))
    half = np.diag([-1.0, -1.0, 1.0, 1.0])
    poses = [pose_down(0.5, y, 0.03, yaw) for y in (-0.1, 0.15) for yaw in (0.3, 1.2)]
    np.testing.assert_array_equal(
        detours(body, poses, wall), detours(body, [pose @ half for pose in poses], wall)
    )


def test_what_hangs_from_the_gripper_counts(body, pose_down, block):
    # A rod that reaches far below the tool touches what the gripper alone clears.
    rod = np.column_stack([np.zeros((60, 2)), np.linspace(0, 0.2, 60)])
    held = HeldObject(points_tool=rod, drop_m=0.2, T_world_tool=np.eye(4), width_m=0.02)
    poses = [pose_down(0.5, y, 0.22) for y in (-0.2, -0.1, 0.1, 0.2)]
    low = block((0.3, -0.3, 0.0), (0.7, 0.3, 0.16), step=0.01)
    bare = detours(body, poses, low, "place")
    loaded = detours(body, poses, low, "place", held)
    assert (loaded >= bare).all() and loaded.sum() > bare.sum()


def test_poses_out_of_reach_need_a_detour(body, pose_down):
    np.testing.assert_array_equal(detours(body, [pose_down(2.0, 0.0, 0.1)], FAR), [1.0])
