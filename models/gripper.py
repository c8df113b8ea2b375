"""A gripper of the Robotiq 2F-85 class in MJCF: two coupled, force-limited parallel fingers."""

import numpy as np
from dm_control import mjcf

from models.gripper_geometry import ROBOTIQ_2F85_CLASS, GripperGeometry

TOOL_SITE = "tool"
FINGER_JOINTS = ("left_finger_joint", "right_finger_joint")
FINGER_ACTUATOR = "fingers"
GRIP_FORCE_N = 80.0
"""Force limit of the closing drive; the data sheet allows 20 to 235 N."""

_PALM_MASS, _FINGER_MASS = 0.78, 0.06
_BLACK = (0.12, 0.12, 0.13, 1.0)
_RUBBER = (0.22, 0.22, 0.24, 1.0)
_PAD_THICKNESS = 0.004

GRIPPER_MASS_KG = _PALM_MASS + 2 * _FINGER_MASS
"""Total mass; the data sheet says 0.9 kg."""


def _add_finger(palm: mjcf.Element, side: int, geometry: GripperGeometry) -> mjcf.Element:
    """Add one finger; `side` is -1 for negative x and +1 for positive x."""
    name = FINGER_JOINTS[(side + 1) // 2]
    half_length = (geometry.tip_below_tool_m + geometry.palm_above_tool_m) / 2
    center_z = geometry.flange_to_tool_m + geometry.tip_below_tool_m - half_length
    finger = palm.add("body", name=name.removesuffix("_joint"), pos=(0, 0, center_z), gravcomp=1)
    # The joint's zero is the closed gripper; its value is the travel of this finger.
    travel = (0, geometry.max_width_m / 2)
    joint = finger.add(
        "joint", name=name, type="slide", axis=(side, 0, 0), range=travel, damping=8, armature=0.2
    )
    steel_half = (geometry.finger_thickness_m - _PAD_THICKNESS) / 2
    finger.add(
        "geom",
        dclass="finger",
        pos=(side * (_PAD_THICKNESS + steel_half), 0, 0),
        size=(steel_half, geometry.pad_half_m[0], half_length),
        mass=_FINGER_MASS,
    )
    finger.add(
        "geom",
        name=name.replace("finger_joint", "pad"),
        dclass="pad",
        pos=(side * _PAD_THICKNESS / 2, 0, half_length - geometry.pad_half_m[1]),
        size=(_PAD_THICKNESS / 2, *geometry.pad_half_m),
    )
    return joint


def _add_defaults(root: mjcf.RootElement) -> None:
    body = root.default.add("default", dclass="body")
    body.geom.set_attributes(type="box", rgba=_BLACK, group=2, mass=0)
    finger = root.default.add("default", dclass="finger")
    finger.geom.set_attributes(
        type="box", rgba=_BLACK, group=2, condim=3, friction=(0.4, 0.005, 0.0001)
    )
    # Rubber: friction 1 wins over the object's (priority), with torsional friction so that an
    # object held off its centre does not swing; contacts as stiff as the time step allows.
    pad = root.default.add("default", dclass="pad")
    pad.geom.set_attributes(
        type="box", rgba=_RUBBER, group=2, mass=0, priority=1, condim=4,
        friction=(1.0, 0.02, 0.0001), solref=(0.004, 1), solimp=(0.95, 0.99, 0.001, 0.5, 2),
    )  # fmt: skip


def build_gripper(geometry: GripperGeometry = ROBOTIQ_2F85_CLASS) -> mjcf.RootElement:
    """Build the gripper; its origin sits on the robot's flange, z pointing away from it.

    The actuator `fingers` commands the travel of each finger (0 closed, half the stroke open) with
    a force limit of `GRIP_FORCE_N`; an equality keeps both fingers at the same travel, as the
    linkage of the real gripper does. The site `tool` is the tool centre point: x along the closing
    direction, z along the approach direction.

    Args:
        geometry: Dimensions in metres.

    Returns:
        The gripper's MJCF.
    """
    root = mjcf.RootElement(model="gripper")
    root.compiler.angle = "radian"
    root.compiler.autolimits = True
    _add_defaults(root)
    palm = root.worldbody.add("body", name="palm", gravcomp=1)
    palm_z = geometry.flange_to_tool_m - geometry.palm_above_tool_m - geometry.palm_depth_m / 2
    palm.add(
        "geom",
        name="palm",
        dclass="body",
        pos=(0, 0, palm_z),
        size=(*geometry.palm_half_m, geometry.palm_depth_m / 2),
        mass=_PALM_MASS,
    )
    palm.add("site", name=TOOL_SITE, pos=(0, 0, geometry.flange_to_tool_m), group=4)
    left, right = (_add_finger(palm, side, geometry) for side in (-1, 1))
    root.equality.add(
        "joint", joint1=left, joint2=right, polycoef=(0, 1, 0, 0, 0), solref=(0.004, 1)
    )
    tendon = root.tendon.add("fixed", name=FINGER_ACTUATOR)
    tendon.add("joint", joint=left, coef=0.5)
    tendon.add("joint", joint=right, coef=0.5)
    root.actuator.add(
        "position",
        name=FINGER_ACTUATOR,
        tendon=tendon,
        kp=4000,
        kv=80,
        ctrlrange=(0, geometry.max_width_m / 2),
        forcerange=(-GRIP_FORCE_N, GRIP_FORCE_N),
    )
    return root


def finger_travel(width_m: float, geometry: GripperGeometry = ROBOTIQ_2F85_CLASS) -> float:
    """Return the actuator command (m) that opens the pads to `width_m`, within the stroke."""
    return float(np.clip(width_m, 0, geometry.max_width_m)) / 2
