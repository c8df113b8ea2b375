"""`SceneConfig` -> `Scene`: draws the objects, composes, lets them settle, draws the goal."""

from dataclasses import dataclass

import mujoco
import numpy as np
from dm_control import mjcf
from scipy.spatial.transform import Rotation

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.objects.asset import ObjectAsset
from models.objects.catalogue import load_object, object_names
from models.objects.words import ObjectWords
from models.workspace import Workspace
from sr_mj.errors import SceneError
from sr_mj.scene.compose import OBJECT_BODY, ComposedScene, compose_scene, home_state
from sr_mj.scene.config import SceneConfig, SceneKind
from sr_mj.scene.goals import Goal, draw_goal, find_targets
from sr_mj.scene.settle import DROP_HEIGHT_M, Drop, FreeBody, Settler, heap_drop

_LAYOUT_TRIES = 20
_LAYOUTS_PER_DRAW = 4
_SPACING_TRIES = 2000
_SET_DOWN_M = 0.01
_GRASP_MARGIN_M = 0.008
_RIM_CATEGORIES = ("container", "cup")


@dataclass(frozen=True, kw_only=True)
class SceneObject:
    """An object in a scene.

    Attributes:
        asset: Geometry and physics.
        body: Its place in the model.
        graspable: The gripper can hold it as it lay when the scene was made: its narrowest width
            seen from above fits, or it stands with an open rim upwards. Sufficient, not necessary.
    """

    asset: ObjectAsset
    body: FreeBody
    graspable: bool

    @property
    def name(self) -> str:
        """Name in the catalogue."""
        return self.asset.name

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


def _is_graspable(asset: ObjectAsset, rotation: np.ndarray) -> bool:
    width = narrowest_width(asset.vertices @ rotation.T)
    upright_rim = asset.words.category in _RIM_CATEGORIES and rotation[2, 2] > 0.9
    return upright_rim or width < ROBOTIQ_2F85_CLASS.max_width_m - _GRASP_MARGIN_M


def _draw_assets(config: SceneConfig, rng: np.random.Generator) -> list[ObjectAsset]:
    wanted = config.kind.num_objects
    if config.objects:
        if len(config.objects) != wanted:
            raise SceneError(
                f"Scene {config.scene!r} has {wanted} objects, got {len(config.objects)} names; "
                "name as many as it has, or none."
            )
        return [load_object(name) for name in config.objects]
    names = object_names(config.split)
    if len(names) < wanted:
        raise SceneError(
            f"Scene {config.scene!r} needs {wanted} objects, split {config.split!r} has "
            f"{len(names)}; choose a smaller scene."
        )
    return [load_object(names[i]) for i in rng.choice(len(names), size=wanted, replace=False)]


def _spread_centers(kind: SceneKind, rng: np.random.Generator) -> np.ndarray:
    """Draw (num_spread, 2) centres with the least spacing between any two, metres."""
    centers: list[np.ndarray] = []
    # A centimetre of reserve: objects rock a little when they are set down.
    spacing = kind.min_spacing_m + 0.01
    for _ in range(_SPACING_TRIES):
        if len(centers) == kind.num_spread:
            return np.array(centers).reshape(-1, 2)
        center = rng.uniform(kind.spread_lower, kind.spread_upper)
        if all(np.linalg.norm(center - other) >= spacing for other in centers):
            centers.append(center)
    raise SceneError(
        f"Found no room for {kind.num_spread} objects {spacing} m apart; use fewer objects or a "
        "larger workspace."
    )


def _set_down(body: FreeBody, center: np.ndarray, rng: np.random.Generator) -> Drop:
    quat = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)).as_quat(scalar_first=True)
    position = np.array([*center, body.bottom_m + _SET_DOWN_M])
    return Drop(position=position, quat_wxyz=quat)


def _spread_apart(data: mujoco.MjData, bodies: tuple[FreeBody, ...], spacing_m: float) -> bool:
    xy = np.array([data.xipos[body.body_id][:2] for body in bodies]).reshape(-1, 2)
    gaps = np.linalg.norm(xy[:, None] - xy[None], axis=-1)[np.triu_indices(len(bodies), 1)]
    return bool(np.all(gaps >= spacing_m))


def _settle(
    composed: ComposedScene, kind: SceneKind, rng: np.random.Generator
) -> np.ndarray | None:
    """Drop everything; return the state (nq,) at rest, or None if the spacing was lost."""
    data = home_state(composed.model)
    if not composed.bodies:
        return data.qpos.copy()
    spread, heaped = composed.bodies[: kind.num_spread], composed.bodies[kind.num_spread :]
    settler = Settler(composed.model, data, composed.bodies, kind.workspace)
    for body, center in zip(spread, _spread_centers(kind, rng), strict=True):
        settler.drop(body, _set_down(body, center, rng))
    for body in heaped:
        settler.drop(
            body, heap_drop(kind.heap_center, kind.heap_half_m, rng, DROP_HEIGHT_M + body.radius_m)
        )
    if heaped:
        settler.recover(kind.heap_center, kind.heap_half_m, rng)
    else:
        settler.wait_until_calm()
    stays = not settler.outside() and _spread_apart(data, spread, kind.min_spacing_m)
    return data.qpos.copy() if stays else None


def _reset_to(model: mujoco.MjModel, qpos: np.ndarray) -> mujoco.MjData:
    """Return a fresh state at rest; robot exactly at home, objects where they lie."""
    data = home_state(model)
    objects = np.arange(model.nq) >= model.nq - 7 * int(np.sum(model.jnt_type == 0))
    data.qpos[objects] = qpos[objects]
    mujoco.mj_forward(model, data)
    return data


def _placed_objects(
    assets: list[ObjectAsset], bodies: tuple[FreeBody, ...], data: mujoco.MjData
) -> tuple[SceneObject, ...]:
    return tuple(
        SceneObject(
            asset=asset,
            body=body,
            graspable=_is_graspable(asset, data.xmat[body.body_id].reshape(3, 3)),
        )
        for asset, body in zip(assets, bodies, strict=True)
    )


def make_scene(config: SceneConfig) -> Scene:
    """Make a scene: draw objects, compose, drop them, let them settle, draw the goal.

    Args:
        config: What to make.

    Returns:
        The scene; the same configuration gives the same bytes on the same mujoco version.

    Raises:
        SceneError: If the objects will not settle in the workspace, or no goal can be drawn.
    """
    draw_rng, settle_rng, goal_rng = np.random.default_rng(config.seed).spawn(3)
    for attempt in range(_LAYOUT_TRIES):
        if attempt % _LAYOUTS_PER_DRAW == 0:
            assets = _draw_assets(config, draw_rng)
            composed = compose_scene(assets, config.cameras)
        qpos = _settle(composed, config.kind, settle_rng)
        if qpos is None:
            continue
        data = _reset_to(composed.model, qpos)
        objects = _placed_objects(assets, composed.bodies, data)
        # A goal can only be drawn if something can be held as it came to lie.
        if config.goal is not None or not objects or any(item.graspable for item in objects):
            break
    else:
        raise SceneError(
            f"{_LAYOUT_TRIES} layouts of scene {config.scene!r} with seed {config.seed} fell over, "
            "too close together, or with nothing that the gripper can hold; use another seed or "
            "other objects."
        )
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


def _choose_goal(
    config: SceneConfig, objects: tuple[SceneObject, ...], rng: np.random.Generator
) -> Goal:
    words = {item.name: item.words for item in objects}
    if config.goal is not None:
        return Goal(text=config.goal, targets=find_targets(config.goal, words))
    if not objects:
        return Goal(text="", targets=())
    return draw_goal(words, [item.name for item in objects if item.graspable], rng)
