"""The robot of every scene: the UR5 with the gripper on its flange."""

from dm_control import mjcf

from models.gripper import FINGER_ACTUATOR, FINGER_JOINTS, TOOL_SITE, build_gripper
from models.ur5 import JOINT_NAMES, TOOL_FLANGE_SITE, build_ur5

GRIPPER_PREFIX = "gripper/"
ROBOT_PREFIX = "ur5/"
ARM_JOINTS = tuple(ROBOT_PREFIX + name for name in JOINT_NAMES)
ARM_ACTUATORS = tuple(name.removesuffix("_joint") for name in ARM_JOINTS)
GRIPPER_JOINTS = tuple(ROBOT_PREFIX + GRIPPER_PREFIX + name for name in FINGER_JOINTS)
GRIPPER_ACTUATOR = ROBOT_PREFIX + GRIPPER_PREFIX + FINGER_ACTUATOR
TOOL_SITE_NAME = ROBOT_PREFIX + GRIPPER_PREFIX + TOOL_SITE
"""Names in a compiled scene, after `attach_robot`."""


def build_robot() -> mjcf.RootElement:
    """Build the UR5 with the gripper attached to its flange site."""
    arm = build_ur5()
    arm.find("site", TOOL_FLANGE_SITE).attach(build_gripper())
    return arm


def attach_robot(root: mjcf.RootElement) -> mjcf.Element:
    """Attach the robot to a scene's world at the origin.

    Args:
        root: The scene, for example from `models.tabletop.build_tabletop`.

    Returns:
        The attachment frame.
    """
    return root.attach(build_robot())
