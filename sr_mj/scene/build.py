"""`SceneConfig` -> `Scene`: lays out the objects, lets them settle, draws the goal."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from dm_control import mjcf

from models.arrangements.paraphrases import wordings
from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.objects.words import ObjectWords
from models.workspace import Workspace
from policy.actions import ActionKind
from sr_mj.errors import SceneError
from sr_mj.instruction import names_target
from sr_mj.scene.arranged import arrange, arranged_goal
from sr_mj.scene.compose import OBJECT_BODY, compose_scene
from sr_mj.scene.config import SceneConfig
from sr_mj.scene.goals import Goal, draw_goal, find_goal
from sr_mj.scene.layout import Layout, draw_drops, draw_objects, fall, state_at_rest, stays
from sr_mj.scene.settle import FreeBody

if TYPE_CHECKING:
    from models.objects.catalogue import CatalogueObject

_LAYOUT_TRIES = 20
_LAYOUTS_PER_DRAW = 4
_GRASP_MARGIN_M = 0.008
_RIM_CATEGORIES = ("container", "cup")


@dataclass(frozen=True, kw_only=True)
class SceneObject:
    """An object in a scene.

    Attributes:
        asset: Geometry and physics; `asset.name` is its name in the catalogue.
        body: Its place in the model.
        graspable: The gripper can hold it as it lay when the scene was made: its narrowest width
            seen from above fits, or it stands with an open rim upwards. Sufficient, not necessary.
    """

    asset: "CatalogueObject"
    body: FreeBody
    graspable: bool

    @property
    def name(self) -> str:
        """Name in the scene: that of the catalogue, numbered where an object occurs twice."""
        return self.body.name

    @property
    def words(self) -> ObjectWords:
        """How people ask for it."""
        return self.asset.words


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """A settled scene, ready to be looked at and acted in.

    `data` is the live state of the simulation and changes as the robot acts; everything else
    stays. Object poses, `goal.targets` and `graspable` are ground truth, which no policy sees.

    Attributes:
        config: What it was made from.
        root: MJCF tree.
        model: Compiled model.
        data: State: objects at rest, robot at home.
        objects: The objects.
        goal: Instruction and targets.
        settled_qpos: (nq,) state right after the scene was made.
    """

    config: SceneConfig
    root: mjcf.RootElement
    model: mujoco.MjModel
    data: mujoco.MjData
    objects: tuple[SceneObject, ...]
    goal: Goal
    settled_qpos: np.ndarray

    @property
    def workspace(self) -> Workspace:
        """Box that the objects started in."""
        return self.config.kind.workspace

    def zone(self, phase: ActionKind) -> Workspace | None:
        """Return the part of the workspace that a phase of the goal keeps to.

        Args:
            phase: Pick or place.

        Returns:
            The kind's zone for it if the goal is to pick something and to place it; None if there
            are no zones, or the goal has one phase alone.
        """
        kind = self.config.kind
        zone = kind.pick_zone if phase == "pick" else kind.place_zone
        is_for_both = self.goal.place is not None and names_target(self.goal.text)
        return zone if is_for_both else None

    def T_world_object(self, name: str) -> np.ndarray:
        """Return the (4, 4) pose of an object's frame in the world. Ground truth."""
        body = self.data.body(f"{name}/{OBJECT_BODY}")
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = body.xmat.reshape(3, 3), body.xpos
        return pose


def narrowest_width(vertices: np.ndarray) -> float:
    """Measure how wide a shape is at least, seen from above.

    Args:
        vertices: (V, 3) in a frame whose z is vertical, metres.

    Returns:
        The smallest extent over horizontal directions, metres (to 5 degrees).
    """
    angles = np.radians(np.arange(0, 180, 5))
    extents = np.ptp(vertices[:, :2] @ np.stack([np.cos(angles), np.sin(angles)]), axis=0)
    return float(extents.min())


def _is_graspable(asset: "CatalogueObject", rotation: np.ndarray) -> bool:
    """Tell whether the gripper can hold an object that is turned by `rotation` (3, 3)."""
    width = narrowest_width(asset.vertices @ rotation.T)
    upright_rim = asset.words.category in _RIM_CATEGORIES and rotation[2, 2] > 0.9
    return upright_rim or width < ROBOTIQ_2F85_CLASS.max_width_m - _GRASP_MARGIN_M


def _placed_objects(layout: Layout, data: mujoco.MjData) -> tuple[SceneObject, ...]:
    return tuple(
        SceneObject(
            asset=asset,
            body=body,
            graspable=_is_graspable(asset, data.xmat[body.body_id].reshape(3, 3)),
        )
        for asset, body in zip(layout.assets, layout.composed.bodies, strict=True)
    )


def make_scene(config: SceneConfig) -> Scene:
    """Make a scene: draw objects or take those arranged, let them settle, draw the goal.

    Args:
        config: What to make.

    Returns:
        The scene; the same configuration gives the same bytes on the same mujoco version.

    Raises:
        SceneError: If the objects will not settle in the workspace, or no goal can be drawn.
        UnknownNameError: If an object does not exist.
    """
    draw_rng, settle_rng, goal_rng = np.random.default_rng(config.seed).spawn(3)
    layout = (
        _random_layout(config, draw_rng, settle_rng) if config.arranged is None else arrange(config)
    )
    composed = layout.composed
    data = state_at_rest(composed.model, layout.qpos)
    objects = _placed_objects(layout, data)
    settled = data.qpos.copy()
    settled.setflags(write=False)
    return Scene(
        config=config,
        root=composed.root,
        model=composed.model,
        data=data,
        objects=objects,
        goal=_choose_goal(config, objects, goal_rng),
        settled_qpos=settled,
    )


def _random_layout(
    config: SceneConfig, draw_rng: np.random.Generator, settle_rng: np.random.Generator
) -> Layout:
    """Draw layouts until one stays, and has something in it that can be held."""
    for attempt in range(_LAYOUT_TRIES):
        if attempt % _LAYOUTS_PER_DRAW == 0:
            assets = draw_objects(config, draw_rng)
            composed = compose_scene(assets, config.cameras)
        drops = draw_drops(composed.bodies, config.kind, settle_rng)
        qpos = fall(composed, drops, config.kind, settle_rng)
        if not stays(composed, qpos, config.kind):
            continue
        layout = Layout(assets=assets, composed=composed, qpos=qpos, drops=drops)
        objects = _placed_objects(layout, state_at_rest(composed.model, qpos))
        # A goal can only be drawn if something can be held as it came to lie.
        if config.goal is not None or not objects or any(item.graspable for item in objects):
            return layout
    raise SceneError(
        f"{_LAYOUT_TRIES} layouts of scene {config.scene!r} with seed {config.seed} fell over, "
        "too close together, or with nothing that the gripper can hold; use another seed or "
        "other objects."
    )


def _choose_goal(
    config: SceneConfig, objects: tuple[SceneObject, ...], rng: np.random.Generator
) -> Goal:
    words = {item.name: item.words for item in objects}
    if config.arranged is not None:
        goal = arranged_goal(config.arranged)
        # Other wordings of an arrangement's goal mean the same objects.
        if config.goal is None or config.goal in wordings(goal.text):
            return replace(goal, text=config.goal or goal.text)
    if config.goal is not None:
        return find_goal(config.goal, words)
    if not objects:
        return Goal(text="", targets=())
    return draw_goal(words, [item.name for item in objects if item.graspable], rng)
