import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.ur5 import HOME_QPOS
from sr_mj.kinematics import ArmKinematics


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


def test_home_points_straight_down(kinematics):
    pose = kinematics.tool_pose(HOME_QPOS)
    np.testing.assert_allclose(pose[:3, 2], [0, 0, -1], atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_solutions_reach_the_pose_within_limits(kinematics, seed):
    rng = np.random.default_rng(seed)
    position = rng.uniform([0.29, -0.21, 0.06], [0.65, 0.21, 0.2])
    pose = tool_pose(position, rng.uniform(0, 30), rng.uniform(0, 360), rng.uniform(0, 360))
    solutions = kinematics.solve_any(pose)
    assert solutions
    for qpos in solutions:
        reached = kinematics.tool_pose(qpos)
        assert np.linalg.norm(reached[:3, 3] - position) < kinematics.config.position_tol_m
        turn = Rotation.from_matrix(reached[:3, :3].T @ pose[:3, :3]).magnitude()
        assert turn < kinematics.config.angle_tol_rad
        assert np.all(np.abs(qpos) <= 2 * np.pi)
        assert kinematics.is_free(qpos)


def test_every_vertical_grasp_in_the_workspace_is_reachable(kinematics):
    missed = [
        (x, y, yaw)
        for x in np.linspace(0.29, 0.71, 4)
        for y in np.linspace(-0.21, 0.21, 4)
        for yaw in (0, 45, 90, 135)
        if not kinematics.solve_any(tool_pose((x, y, 0.03), yaw_deg=yaw))
    ]
    assert missed == []


def test_out_of_reach_has_no_solution(kinematics):
    assert kinematics.solve_any(tool_pose((1.5, 0, 0.2))) == []


def test_under_the_table_has_no_free_solution(kinematics):
    assert kinematics.solve_any(tool_pose((0.5, 0, -0.05))) == []


def test_same_question_same_answer(kinematics):
    pose = tool_pose((0.5, 0.1, 0.1), 20, 40, 60)
    first = kinematics.solve_any(pose)
    kinematics.solve_any(tool_pose((0.3, -0.2, 0.05)))
    for a, b in zip(first, kinematics.solve_any(pose), strict=True):
        np.testing.assert_array_equal(a, b)
