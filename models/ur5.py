"""The UR5 arm in MJCF, from sourced constants.

Link frames, masses, joint limits and meshes are those of `ur_description` (BSD-3-Clause), as the
PyPI package `example-robot-data` 6.0.0 carries it; velocity and effort limits agree with Universal
Robots' data sheet (180 degrees/s on every joint; 150 and 28 N m).

Two departures from that URDF, both about inertia. It puts the centre of mass of the wrist links
on their joint axes and gives them up to 0.22 kg m^2, which no 1.2 kg link of 12 cm can have: we
take solid cylinders at the centre of each wrist's mesh. And the centres of mass of the upper arm
and the forearm follow Universal Robots' published table ("DH Parameters for calculations of
kinematics and dynamics", https://www.universal-robots.com/articles/ur/application-installation/).
"""

from dataclasses import dataclass
from importlib import resources

import numpy as np
from dm_control import mjcf

HOME_QPOS = np.pi * np.array([0.0, -0.8, 0.5, -0.2, -0.5, 0.0])
HOME_QPOS.setflags(write=False)

MAX_JOINT_SPEED = np.pi
"""Velocity limit of every joint, rad/s."""

TOOL_FLANGE_SITE = "flange"

_HALF_TURN_Y = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
_IDENTITY = (1.0, 0.0, 0.0, 0.0)
_GREY = (0.75, 0.76, 0.78, 1.0)
_DARK = (0.25, 0.27, 0.30, 1.0)
_BLUE = (0.35, 0.55, 0.75, 1.0)


@dataclass(frozen=True, kw_only=True)
class _Capsule:
    """A collision capsule in the link frame: end points and radius, metres."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float


@dataclass(frozen=True, kw_only=True)
class _Link:
    """One moving link, with the joint that carries it.

    Positions in metres in the parent's frame (`pos`) or in the link's own; inertia in kg m^2.
    """

    name: str
    joint: str
    mesh: str
    pos: tuple[float, float, float]
    axis: tuple[float, float, float]
    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float]
    capsules: tuple[_Capsule, ...]
    effort: float
    kp: float
    armature: float
    quat: tuple[float, float, float, float] = _IDENTITY
    joint_range: tuple[float, float] = (-2 * np.pi, 2 * np.pi)
    rgba: tuple[float, float, float, float] = _GREY


def _cylinder_inertia(mass: float, radius: float, length: float, axis: int) -> tuple:
    """Principal inertia of a solid cylinder along coordinate `axis` (0, 1 or 2)."""
    inertia = np.full(3, mass * (3 * radius**2 + length**2) / 12)
    inertia[axis] = mass * radius**2 / 2
    return tuple(inertia)


# The reflected inertia of motors and gears (armature) is not published; 0.1 and 0.03 kg m^2 are
# our assumption, of the order of the harmonic drives' 1:101 ratio squared times small rotors.
_LINKS = (
    _Link(
        name="shoulder_link", joint="shoulder_pan_joint", mesh="shoulder",
        pos=(0, 0, 0.089159), axis=(0, 0, 1), mass=3.7, com=(0, 0.00193, -0.02561),
        inertia=(0.010267495893, 0.010267495893, 0.00666),
        capsules=(_Capsule(start=(0, 0, -0.02), end=(0, 0.02, 0), radius=0.06),),
        effort=150, kp=4000, armature=0.1,
    ),
    _Link(
        name="upper_arm_link", joint="shoulder_lift_joint", mesh="upperarm",
        pos=(0, 0.13585, 0), quat=_HALF_TURN_Y, axis=(0, 1, 0),
        mass=8.393, com=(0, -0.02249, 0.2125),
        inertia=(0.22689067591, 0.22689067591, 0.0151074),
        capsules=(_Capsule(start=(0, 0, 0), end=(0, 0, 0.425), radius=0.06),),
        effort=150, kp=4000, armature=0.1, rgba=_BLUE,
    ),
    _Link(
        name="forearm_link", joint="elbow_joint", mesh="forearm",
        pos=(0, -0.1197, 0.425), axis=(0, 1, 0), mass=2.275, com=(0, 0.01035, 0.24225),
        inertia=(0.049443313556, 0.049443313556, 0.004095),
        capsules=(_Capsule(start=(0, 0, 0), end=(0, 0, 0.385), radius=0.055),),
        effort=150, kp=3000, armature=0.1, joint_range=(-np.pi, np.pi),
    ),
    _Link(
        name="wrist_1_link", joint="wrist_1_joint", mesh="wrist1",
        pos=(0, 0, 0.39225), quat=_HALF_TURN_Y, axis=(0, 1, 0), mass=1.219, com=(0, 0.09, 0),
        inertia=_cylinder_inertia(1.219, 0.042, 0.105, 2),
        capsules=(_Capsule(start=(0, 0.09, -0.02), end=(0, 0.09, 0.01), radius=0.042),),
        effort=28, kp=1000, armature=0.03, rgba=_BLUE,
    ),
    _Link(
        name="wrist_2_link", joint="wrist_2_joint", mesh="wrist2",
        pos=(0, 0.093, 0), axis=(0, 0, 1), mass=1.219, com=(0, 0, 0.09),
        inertia=_cylinder_inertia(1.219, 0.042, 0.105, 1),
        capsules=(_Capsule(start=(0, -0.02, 0.091), end=(0, 0.01, 0.091), radius=0.042),),
        effort=28, kp=1000, armature=0.03,
    ),
    _Link(
        name="wrist_3_link", joint="wrist_3_joint", mesh="wrist3",
        pos=(0, 0, 0.09465), axis=(0, 1, 0), mass=0.1879, com=(0, 0.065, 0),
        inertia=_cylinder_inertia(0.1879, 0.0375, 0.034, 1),
        capsules=(_Capsule(start=(0, 0.055, 0), end=(0, 0.065, 0), radius=0.034),),
        effort=28, kp=600, armature=0.03, rgba=_DARK,
    ),
)  # fmt: skip

JOINT_NAMES = tuple(link.joint for link in _LINKS)
LINK_MASSES = {"base": 4.0} | {link.name: link.mass for link in _LINKS}
"""Mass of every link in kg, as published in the URDF."""


def _add_mesh(root: mjcf.RootElement, name: str) -> None:
    data = resources.files("models").joinpath(f"assets/ur5/{name}.stl").read_bytes()
    root.asset.add("mesh", name=name, file=mjcf.Asset(data, ".stl"))


def _add_geoms(body: mjcf.Element, mesh: str, rgba: tuple, capsules: tuple[_Capsule, ...]) -> None:
    body.add("geom", dclass="visual", type="mesh", mesh=mesh, rgba=rgba)
    for capsule in capsules:
        body.add(
            "geom",
            dclass="collision",
            type="capsule",
            fromto=(*capsule.start, *capsule.end),
            size=[capsule.radius],
        )


def _add_defaults(root: mjcf.RootElement) -> None:
    visual = root.default.add("default", dclass="visual")
    visual.geom.set_attributes(contype=0, conaffinity=0, group=1, mass=0)
    collision = root.default.add("default", dclass="collision")
    collision.geom.set_attributes(group=3, mass=0, condim=3, friction=(0.5, 0.005, 0.0001))


def build_ur5() -> mjcf.RootElement:
    """Build the arm with position actuators, gravity-compensated as the real controller does.

    Returns:
        The arm's MJCF; its base frame is the UR's `base_link`, and the site `flange` is the tool
        flange with z pointing out of it (`tool0`), where a gripper attaches.
    """
    root = mjcf.RootElement(model="ur5")
    root.compiler.angle = "radian"
    root.compiler.autolimits = True
    _add_defaults(root)
    for mesh in ("base", *(link.mesh for link in _LINKS)):
        _add_mesh(root, mesh)

    body = root.worldbody.add("body", name="base")
    base_inertia = (0.00443333156, 0.00443333156, 0.0072)
    body.add("inertial", mass=LINK_MASSES["base"], pos=(0, 0, 0), diaginertia=base_inertia)
    _add_geoms(body, "base", _DARK, ())

    for link in _LINKS:
        body = body.add("body", name=link.name, pos=link.pos, quat=link.quat, gravcomp=1)
        body.add("inertial", mass=link.mass, pos=link.com, diaginertia=link.inertia)
        joint = body.add(
            "joint",
            name=link.joint,
            axis=link.axis,
            range=link.joint_range,
            armature=link.armature,
        )
        _add_geoms(body, link.mesh, link.rgba, link.capsules)
        root.actuator.add(
            "position",
            name=link.joint.removesuffix("_joint"),
            joint=joint,
            kp=link.kp,
            dampratio=1.6,  # above 1: neighbouring links move, and count, as well
            ctrlrange=link.joint_range,
            forcerange=(-link.effort, link.effort),
        )
    # Rotating z onto the flange normal, the wrist's y axis: tool0 of the URDF.
    body.add("site", name=TOOL_FLANGE_SITE, pos=(0, 0.0823, 0), euler=(-np.pi / 2, 0, 0), group=4)
    return root
