import numpy as np
import pytest

from models.ur5 import HOME_QPOS
from sr_mj.closed_form import JOINT_LIMITS, nearest_turns, solve_closed_form
from sr_mj.kinematics import ArmKinematics


@pytest.fixture(scope="module")
def kinematics():
    return ArmKinematics()


def random_postures(num, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (num, 6)) * JOINT_LIMITS


def test_every_branch_reaches_the_pose_and_one_is_the_posture_it_came_from(kinematics):
    postures = random_postures(200)
    poses = np.array([kinematics.tool_pose(posture) for posture in postures])
    for posture, pose, branches in zip(postures, poses, solve_closed_form(poses), strict=True):
        found = branches[np.isfinite(branches).all(axis=1)]
        assert len(found) >= 2
        for qpos in found:
            np.testing.assert_allclose(kinematics.tool_pose(qpos), pose, atol=1e-8)
        gaps = (found - posture + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(gaps).max(axis=1).min() < 1e-7


def test_branches_are_distinct_and_within_the_limits(kinematics):
    poses = np.array([kinematics.tool_pose(posture) for posture in random_postures(50, seed=1)])
    for branches in solve_closed_form(poses):
        found = branches[np.isfinite(branches).all(axis=1)]
        assert np.all(np.abs(found) <= JOINT_LIMITS)
        gaps = np.abs(found[:, None] - found[None]).max(axis=2) + 9 * np.eye(len(found))
        assert gaps.min() > 1e-6


def test_a_pose_is_solved_the_same_alone_and_among_others(kinematics):
    poses = np.array([kinematics.tool_pose(posture) for posture in random_postures(9)])
    together = solve_closed_form(poses)
    for pose, branches in zip(poses, together, strict=True):
        np.testing.assert_array_equal(solve_closed_form(pose)[0], branches)


def test_out_of_reach_is_nan_in_every_branch():
    pose = np.diag([1.0, -1, -1, 1])
    pose[:3, 3] = 1.6, 0, 0.1
    assert np.isnan(solve_closed_form(pose)).all()
    assert solve_closed_form(np.zeros((0, 4, 4))).shape == (0, 8, 6)


def test_full_turns_go_to_the_reference(kinematics):
    pose = kinematics.tool_pose(HOME_QPOS)
    turned = HOME_QPOS + np.array([0, 0, 0, 0, 0, 2 * np.pi])
    for reference in (HOME_QPOS, turned):
        gaps = np.abs(solve_closed_form(pose, reference)[0] - reference).max(axis=1)
        assert np.nanmin(gaps) < 1e-9


@pytest.mark.parametrize(("angle", "reference", "expected"), [
    (0.5, 6.0, 0.5 + 2 * np.pi - 2 * np.pi), (0.5, 3.0, 0.5), (0.5, -6.0, 0.5 - 2 * np.pi),
    (-0.5, 6.0, -0.5 + 2 * np.pi), (3.0, 40.0, 3.0),
])  # fmt: skip
def test_turns_stay_within_the_limits(angle, reference, expected):
    near = nearest_turns(np.full(6, angle), np.full(6, reference))
    assert near[0] == pytest.approx(expected)
    assert np.all(np.abs(near) <= JOINT_LIMITS)
