import mujoco
import numpy as np
import pytest

from models.gripper import GRIPPER_MASS_KG
from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.robot import ARM_ACTUATORS, ARM_JOINTS, GRIPPER_JOINTS, TOOL_SITE_NAME, attach_robot
from models.tabletop import build_tabletop
from models.ur5 import HOME_QPOS, LINK_MASSES, build_ur5

# Denavit-Hartenberg parameters that Universal Robots publishes for the UR5 (a, alpha, d).
DH = [
    (0.0, np.pi / 2, 0.089159),
    (-0.425, 0.0, 0.0),
    (-0.39225, 0.0, 0.0),
    (0.0, np.pi / 2, 0.10915),
    (0.0, -np.pi / 2, 0.09465),
    (0.0, 0.0, 0.0823),
]
POSTURES = [HOME_QPOS, *np.random.default_rng(3).uniform(-np.pi, np.pi, (4, 6))]


def flange_pose_by_dh(qpos):
    # The URDF's base is turned by half a turn against the controller's.
    pose = np.diag([-1.0, -1.0, 1.0, 1.0])
    for (a, alpha, d), theta in zip(DH, qpos, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        pose = pose @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return pose


@pytest.fixture(scope="module")
def robot_model():
    root = build_tabletop()
    attach_robot(root)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


@pytest.fixture
def data(robot_model):
    data = mujoco.MjData(robot_model)
    data.qpos[:6] = data.ctrl[:6] = HOME_QPOS
    mujoco.mj_forward(robot_model, data)
    return data


@pytest.mark.parametrize("qpos", POSTURES)
def test_tool_is_where_the_published_dh_parameters_put_it(robot_model, data, qpos):
    data.qpos[:6] = qpos
    mujoco.mj_forward(robot_model, data)
    flange = flange_pose_by_dh(qpos)
    tool = data.site(TOOL_SITE_NAME)
    expected = flange[:3, 3] + ROBOTIQ_2F85_CLASS.flange_to_tool_m * flange[:3, 2]
    np.testing.assert_allclose(tool.xpos, expected, atol=1e-3)
    np.testing.assert_allclose(tool.xmat.reshape(3, 3), flange[:3, :3], atol=1e-6)


def test_masses_are_the_published_ones(robot_model):
    arm = build_ur5()
    alone = mujoco.MjModel.from_xml_string(arm.to_xml_string(), arm.get_assets())
    assert alone.body_mass.sum() == pytest.approx(4.0 + 3.7 + 8.393 + 2.275 + 2 * 1.219 + 0.1879)
    assert sum(LINK_MASSES.values()) == pytest.approx(alone.body_mass.sum())
    whole = robot_model.body("ur5/base").subtreemass
    assert whole == pytest.approx(alone.body_mass.sum() + GRIPPER_MASS_KG)


def test_inertias_are_physical_for_the_size_of_the_links(robot_model):
    # No point of a wrist link is farther than 0.15 m from its centre of mass.
    for name in ("wrist_1_link", "wrist_2_link", "wrist_3_link"):
        body = robot_model.body(f"ur5/{name}")
        assert np.all(body.inertia < body.mass * 0.15**2)
        assert np.all(body.inertia > 0)


def test_joint_limits(robot_model):
    ranges = np.array([robot_model.joint(name).range for name in ARM_JOINTS])
    expected = np.full((6, 2), [-2 * np.pi, 2 * np.pi])
    expected[2] = [-np.pi, np.pi]
    np.testing.assert_allclose(ranges, expected)


def test_home_touches_nothing_and_is_held(robot_model, data):
    assert data.ncon == 0
    mujoco.mj_step(robot_model, data, 500)
    np.testing.assert_allclose(data.qpos[:6], HOME_QPOS, atol=1e-6)


@pytest.mark.parametrize("joint", range(6))
def test_steps_are_followed_without_oscillation(robot_model, data, joint):
    target = HOME_QPOS.copy()
    target[joint] += 0.05
    data.ctrl[:6] = target
    overshoot = 0.0
    for _ in range(1000):
        mujoco.mj_step(robot_model, data)
        overshoot = max(overshoot, data.qpos[joint] - target[joint])
    np.testing.assert_allclose(data.qpos[:6], target, atol=1e-4)
    assert overshoot < 0.05 * 0.05


def test_every_arm_joint_has_its_actuator(robot_model):
    for joint, actuator in zip(ARM_JOINTS, ARM_ACTUATORS, strict=True):
        assert robot_model.actuator(actuator).trnid[0] == robot_model.joint(joint).id


def test_fingers_move_together_over_the_whole_stroke(robot_model, data):
    travel = np.array([data.joint(name).qpos for name in GRIPPER_JOINTS])
    np.testing.assert_allclose(travel, 0, atol=1e-6)
    data.actuator("ur5/gripper/fingers").ctrl = 0.0425
    mujoco.mj_step(robot_model, data, 500)
    pads = [data.geom(f"ur5/gripper/{side}_pad").xpos for side in ("left", "right")]
    gap = np.linalg.norm(pads[0] - pads[1]) - 2 * robot_model.geom("ur5/gripper/left_pad").size[0]
    assert gap == pytest.approx(0.085, abs=5e-4)
    left, right = (data.joint(name).qpos[0] for name in GRIPPER_JOINTS)
    assert left == pytest.approx(right, abs=1e-4)


def test_gripper_boxes_bound_the_gripper(robot_model, data):
    width = 0.05
    data.joint(GRIPPER_JOINTS[0]).qpos = data.joint(GRIPPER_JOINTS[1]).qpos = width / 2
    mujoco.mj_forward(robot_model, data)
    tool = data.site(TOOL_SITE_NAME)
    centers, halves = ROBOTIQ_2F85_CLASS.boxes(width)
    lower, upper = (centers - halves), (centers + halves)
    for geom in range(robot_model.ngeom):
        body = robot_model.body(robot_model.geom_bodyid[geom]).name
        if not body.startswith("ur5/gripper/"):
            continue
        size, R = robot_model.geom_size[geom], data.geom_xmat[geom].reshape(3, 3)
        corners = np.array(np.meshgrid(*[[-s, s] for s in size])).reshape(3, -1).T
        world = data.geom_xpos[geom] + corners @ R.T
        local = (world - tool.xpos) @ tool.xmat.reshape(3, 3)
        inside = (local[:, None] >= lower - 1e-6) & (local[:, None] <= upper + 1e-6)
        assert inside.all(axis=2).all(axis=0).any(), robot_model.geom(geom).name
