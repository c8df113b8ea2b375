"""Random layouts: which objects a scene has, and where they come to lie."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from models.objects.catalogue import open_catalogue
from sr_mj.errors import SceneError
from sr_mj.scene.compose import ComposedScene, home_state
from sr_mj.scene.config import SceneConfig, SceneKind
from sr_mj.scene.settle import DROP_HEIGHT_M, Drop, FreeBody, Settler, heap_drop

if TYPE_CHECKING:
    from models.objects.catalogue import CatalogueObject

_SPACING_TRIES = 100
_SPACING_DRAWS = 200
_SET_DOWN_M = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """Objects at rest.

    Attributes:
        assets: The objects.
        composed: Their scene.
        qpos: (nq,) the state at rest.
        drops: The pose from which each object fell, in the order in which they did.
    """

    assets: "tuple[CatalogueObject, ...]"
    composed: ComposedScene
    qpos: np.ndarray
    drops: tuple[Drop, ...]


def draw_objects(config: SceneConfig, rng: np.random.Generator) -> "tuple[CatalogueObject, ...]":
    """Draw the objects of a scene, each at most once, or load those that are named.

    Args:
        config: The scene.
        rng: Source of randomness.

    Returns:
        The objects.

    Raises:
        SceneError: If the number of names is wrong, or the catalogue has too few objects.
        UnknownNameError: If an object does not exist.
    """
    wanted = config.kind.num_objects
    catalogue = open_catalogue(config.catalogue)
    if config.objects:
        if len(config.objects) != wanted:
            raise SceneError(
                f"Scene {config.scene!r} has {wanted} objects, got {len(config.objects)} names; "
                "name as many as it has, or none."
            )
        return tuple(catalogue.load(name) for name in config.objects)
    names = catalogue.names(config.split)
    if len(names) < wanted:
        where = f"split {config.split!r}" if config.catalogue is None else catalogue.source
        raise SceneError(
            f"Scene {config.scene!r} needs {wanted} objects, {where} has {len(names)}; choose a "
            "smaller scene."
        )
    return tuple(
        catalogue.load(names[i]) for i in rng.choice(len(names), size=wanted, replace=False)
    )


def spread_centers(kind: SceneKind, rng: np.random.Generator) -> np.ndarray:
    """Draw (num_spread, 2) centres with the least spacing between any two, metres.

    Args:
        kind: Says how many, where and how far apart.
        rng: Source of randomness.

    Returns:
        The centres.

    Raises:
        SceneError: If there is no room.
    """
    # A centimetre of reserve: objects rock a little when they are set down.
    spacing = kind.min_spacing_m + 0.01
    for _ in range(_SPACING_TRIES):
        centers = np.zeros((0, 2))
        # The first few may leave no room for the last: then all are drawn anew.
        for center in rng.uniform(kind.spread_lower, kind.spread_upper, (_SPACING_DRAWS, 2)):
            if len(centers) == kind.num_spread:
                return centers
            if np.all(np.linalg.norm(centers - center, axis=1) >= spacing):
                centers = np.vstack([centers, center])
    raise SceneError(
        f"Found no room for {kind.num_spread} objects {spacing} m apart; use fewer objects or a "
        "larger workspace."
    )


def _set_down(body: FreeBody, center: np.ndarray, rng: np.random.Generator) -> Drop:
    quat = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)).as_quat(scalar_first=True)
    position = np.array([*center, body.bottom_m + _SET_DOWN_M])
    return Drop(position=position, quat_wxyz=quat)


def draw_drops(
    bodies: Sequence[FreeBody], kind: SceneKind, rng: np.random.Generator
) -> tuple[Drop, ...]:
    """Draw the pose from which each object falls: those set apart first, then the heap.

    Args:
        bodies: The objects.
        kind: Says how they are arranged.
        rng: Source of randomness.

    Returns:
        One pose an object.

    Raises:
        SceneError: If there is no room.
    """
    spread, heaped = bodies[: kind.num_spread], bodies[kind.num_spread :]
    centers = spread_centers(kind, rng)
    apart = [_set_down(body, xy, rng) for body, xy in zip(spread, centers, strict=True)]
    heap = [
        heap_drop(kind.heap_center, kind.heap_half_m, rng, DROP_HEIGHT_M + body.radius_m)
        for body in heaped
    ]
    return (*apart, *heap)


def keeps_apart(data: mujoco.MjData, bodies: Sequence[FreeBody], spacing_m: float) -> bool:
    """Tell whether the centres of mass of objects keep a distance, seen from above.

    Args:
        data: The state.
        bodies: The objects.
        spacing_m: The least distance.

    Returns:
        Whether no two are closer.
    """
    xy = np.array([data.xipos[body.body_id][:2] for body in bodies]).reshape(-1, 2)
    gaps = np.linalg.norm(xy[:, None] - xy[None], axis=-1)[np.triu_indices(len(bodies), 1)]
    return bool(np.all(gaps >= spacing_m))


def fall(
    composed: ComposedScene,
    drops: Sequence[Drop],
    kind: SceneKind,
    rng: np.random.Generator | None = None,
) -> np.ndarray:
    """Drop everything and let it come to rest.

    Args:
        composed: The scene.
        drops: One pose an object, in the order in which they fall.
        kind: Workspace and heap.
        rng: Where objects that left the workspace are dropped again; None to leave it at one drop
            each, so that the drops alone decide.

    Returns:
        The state (nq,) at rest.

    Raises:
        SceneError: If the simulation became unstable, or objects will not stay.
    """
    data = home_state(composed.model)
    if composed.bodies:
        settler = Settler(composed.model, data, composed.bodies, kind.workspace)
        for body, drop in zip(composed.bodies, drops, strict=True):
            settler.drop(body, drop)
        if kind.num_heaped and rng is not None:
            settler.recover(kind.heap_center, kind.heap_half_m, rng)
        else:
            settler.wait_until_calm()
    return data.qpos.copy()


def stays(composed: ComposedScene, qpos: np.ndarray, kind: SceneKind) -> bool:
    """Tell whether a layout is what its kind of scene promises.

    Args:
        composed: The scene.
        qpos: (nq,) state at rest.
        kind: Workspace and least spacing.

    Returns:
        Whether every object lies in the workspace, and those set apart keep their distance.
    """
    data = state_at_rest(composed.model, qpos)
    settler = Settler(composed.model, data, composed.bodies, kind.workspace)
    spread = composed.bodies[: kind.num_spread]
    return not settler.outside() and keeps_apart(data, spread, kind.min_spacing_m)


def state_at_rest(model: mujoco.MjModel, qpos: np.ndarray) -> mujoco.MjData:
    """Return a fresh state at rest; robot exactly at home, objects where they lie.

    Args:
        model: Compiled scene.
        qpos: (nq,) where the objects lie.

    Returns:
        The state, after a forward pass.
    """
    data = home_state(model)
    objects = np.arange(model.nq) >= model.nq - 7 * int(np.sum(model.jnt_type == 0))
    data.qpos[objects] = qpos[objects]
    mujoco.mj_forward(model, data)
    return data
