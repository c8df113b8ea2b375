import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.ur5 import HOME_QPOS
from sr_mj.closed_form import solve_closed_form
from sr_mj.kinematics import ArmKinematics
from sr_mj.planning import straight_poses


@pytest.fixture(scope="module")
def kinematics():
    return ArmKinematics()


def tool_pose(position, tilt_deg=0.0, azimuth_deg=0.0, yaw_deg=0.0):
    down = Rotation.from_euler("x", np.pi)
    tilt = Rotation.from_euler("zyz", [azimuth_deg, tilt_deg, yaw_deg - azimuth_deg], degrees=True)
    pose = np.eye(4)
    pose[:3, :3] = (tilt * down).as_matrix()
    pose[:3, 3] = position
    return pose


def postures(kinematics, pose):
    """Solutions from every branch of the closed form, nearest to home first."""
    seeds = solve_closed_form(pose)[0]
    seeds = seeds[np.isfinite(seeds).all(axis=1)]
    seeds = seeds[np.argsort(np.abs(seeds - HOME_QPOS).max(axis=1))]
    return np.array([kinematics.solve(pose, seed) for seed in seeds]).reshape(-1, 6)


def test_home_points_straight_down(kinematics):
    pose = kinematics.tool_pose(HOME_QPOS)
    np.testing.assert_allclose(pose[:3, 2], [0, 0, -1], atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_postures_reach_the_pose_within_limits(kinematics, seed):
    rng = np.random.default_rng(seed)
    position = rng.uniform([0.29, -0.21, 0.06], [0.65, 0.21, 0.2])
    pose = tool_pose(position, rng.uniform(0, 30), rng.uniform(0, 360), rng.uniform(0, 360))
    found = postures(kinematics, pose)
    assert len(found)
    for qpos in found:
        reached = kinematics.tool_pose(qpos)
        assert np.linalg.norm(reached[:3, 3] - position) < kinematics.config.position_tol_m
        turn = Rotation.from_matrix(reached[:3, :3].T @ pose[:3, :3]).magnitude()
        assert turn < kinematics.config.angle_tol_rad
        assert np.all(np.abs(qpos) <= 2 * np.pi)


def test_solves_from_a_start_that_is_off(kinematics):
    pose = tool_pose((0.5, 0.1, 0.2), 20, 40, 60)
    exact = postures(kinematics, pose)[0]
    solved = kinematics.solve(pose, exact + 0.2)
    reached = kinematics.tool_pose(solved)
    assert np.linalg.norm(reached[:3, 3] - pose[:3, 3]) < kinematics.config.position_tol_m
    np.testing.assert_allclose(solved, exact, atol=0.01)


def test_out_of_reach_has_no_solution(kinematics):
    pose = tool_pose((1.5, 0, 0.2))
    assert postures(kinematics, pose).shape == (0, 6)
    assert kinematics.solve(pose, HOME_QPOS) is None


def test_does_not_press_the_gripper_through_the_table(kinematics):
    above = tool_pose((0.5, 0, 0.05))
    start = postures(kinematics, above)[0]
    below = tool_pose((0.5, 0, -0.05))
    assert kinematics.solve(below, start) is None
    path = straight_poses(above, below, 0.01)
    assert kinematics.follow(path, start, 0.35) is None


def test_follows_a_straight_way_without_a_jump(kinematics):
    path = straight_poses(tool_pose((0.5, 0, 0.05)), tool_pose((0.5, 0, 0.25)), 0.01)
    followed = kinematics.follow(path, postures(kinematics, path[0])[0], 0.35)
    assert followed.shape == (len(path), 6)
    assert np.abs(np.diff(followed, axis=0)).max() < 0.1
    for pose, posture in zip(path, followed, strict=True):
        np.testing.assert_allclose(kinematics.tool_pose(posture), pose, atol=2e-3)
    assert kinematics.follow(path, followed[0], 1e-3) is None


def test_same_question_same_answer(kinematics):
    pose = tool_pose((0.5, 0.1, 0.1), 20, 40, 60)
    first = postures(kinematics, pose)
    postures(kinematics, tool_pose((0.3, -0.2, 0.05)))
    np.testing.assert_array_equal(first, postures(kinematics, pose))
