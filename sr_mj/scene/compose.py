"""Composes a scene's MJCF tree: tabletop, robot, cameras, and one free body per object."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from dm_control import mjcf

from models.arrangements.arrangement import instance_names
from models.camera_mjcf import add_cameras
from models.cameras import OVERVIEW, camera_preset
from models.objects.mjcf_builder import build_object
from models.robot import ARM_ACTUATORS, ARM_JOINTS, attach_robot
from models.tabletop import build_tabletop
from models.ur5 import HOME_QPOS
from sr_mj.scene.settle import FreeBody

if TYPE_CHECKING:
    from models.objects.catalogue import CatalogueObject

OBJECT_BODY = "object"
"""Name of the body in every object's tree."""

_WAITING_HEIGHT_M, _WAITING_GAP_M = 2.0, 0.6


@dataclass(frozen=True, kw_only=True)
class ComposedScene:
    """A scene before its objects have been put anywhere.

    Attributes:
        root: MJCF tree.
        model: The compiled tree.
        bodies: The objects' places in the model, in the order given.
    """

    root: mjcf.RootElement
    model: mujoco.MjModel
    bodies: tuple[FreeBody, ...]


def compile_mjcf(root: mjcf.RootElement) -> mujoco.MjModel:
    """Compile an MJCF tree.

    Args:
        root: The tree.

    Returns:
        The model.
    """
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def _free_body(model: mujoco.MjModel, name: str, asset: "CatalogueObject") -> FreeBody:
    # dm_control attaches through a frame body, which carries the joint; the object is its child.
    joint = model.joint(int(model.body(f"{name}/").jntadr[0]))
    return FreeBody(
        name=name,
        body_id=model.body(f"{name}/{OBJECT_BODY}").id,
        qpos_adr=int(joint.qposadr[0]),
        dof_adr=int(joint.dofadr[0]),
        bottom_m=-float(asset.vertices[:, 2].min()),
        radius_m=float(np.linalg.norm(asset.vertices, axis=1).max()),
    )


def compose_scene(
    assets: "Sequence[CatalogueObject]", cameras: str, model_name: str = "scene"
) -> ComposedScene:
    """Compose and compile a scene.

    Args:
        assets: The objects; their names become prefixes (`apple/`), numbered where one occurs
            more than once (`apple_2/`).
        cameras: Camera preset.
        model_name: Name of the MJCF model.

    Returns:
        The scene; in `qpos0` the objects hover above each other, high over the table, clear of
        everything and of one another.
    """
    root = build_tabletop(model_name)
    attach_robot(root)
    add_cameras(root, (*camera_preset(cameras), OVERVIEW))
    names = instance_names(asset.name for asset in assets)
    for index, (name, asset) in enumerate(zip(names, assets, strict=True)):
        frame = root.attach(build_object(asset, name=name))
        frame.pos = (0.5, 0, _WAITING_HEIGHT_M + index * _WAITING_GAP_M)
        frame.add("freejoint")
    model = compile_mjcf(root)
    bodies = (_free_body(model, name, asset) for name, asset in zip(names, assets, strict=True))
    return ComposedScene(root=root, model=model, bodies=tuple(bodies))


def home_state(model: mujoco.MjModel) -> mujoco.MjData:
    """Return a fresh state with the arm at home and the gripper closed.

    Args:
        model: A model that contains the robot of `models.robot`.

    Returns:
        The state, after a forward pass.
    """
    data = mujoco.MjData(model)
    for joint, actuator, angle in zip(ARM_JOINTS, ARM_ACTUATORS, HOME_QPOS, strict=True):
        data.joint(joint).qpos[0] = angle
        data.actuator(actuator).ctrl[0] = angle
    mujoco.mj_forward(model, data)
    return data
