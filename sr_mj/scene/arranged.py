"""Layouts from fixed arrangements, and whether dropping the objects again gives the same."""

import logging
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from models.arrangements.arrangement import ArrangedObject, Arrangement, Pose
from models.objects.catalogue import open_catalogue
from models.objects.fingerprint import fingerprint, matches
from sr_mj.errors import SceneError
from sr_mj.scene.compose import ComposedScene, compose_scene, home_state
from sr_mj.scene.config import SceneConfig
from sr_mj.scene.goals import Goal, PlaceGoal
from sr_mj.scene.layout import Layout, fall, stays
from sr_mj.scene.settle import Drop

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class Difference:
    """An object that does not come to lie where its arrangement says.

    Attributes:
        name: Its name in the arrangement.
        moved_m: Distance between the positions.
        is_changed: Its geometry or mass is not what the arrangement was settled with.
    """

    name: str
    moved_m: float
    is_changed: bool


def arrange(config: SceneConfig) -> Layout:
    """Lay the objects of an arrangement where they belong.

    Poses at rest are taken as they are stored, so that everybody starts from the same state. Where
    MuJoCo has another version than the one that settled them, or an object another shape, the
    objects are dropped again and what differs is logged as a warning; objects of another shape
    make the whole heap lie as it fell now. An arrangement that was never settled is dropped, and
    what leaves the workspace dropped again.

    Args:
        config: A configuration with an arrangement.

    Returns:
        The layout.

    Raises:
        UnknownNameError: If an object does not exist.
        SceneError: If the objects do not stay in the workspace.
    """
    arrangement = config.arranged
    assert arrangement is not None
    layout = _undropped(arrangement, config)
    composed = layout.composed
    if not arrangement.is_settled:
        return replace(layout, qpos=_drop_and_recover(config, layout))
    stored = stored_qpos(arrangement, composed)
    changed = _changed_objects(arrangement, layout)
    if arrangement.mujoco == mujoco.__version__ and not changed:
        return replace(layout, qpos=stored)
    qpos = drop_again(arrangement, composed)
    for difference in _differences(arrangement, stored, qpos, composed, changed):
        _logger.warning("%s", describe(arrangement, difference))
    return replace(layout, qpos=qpos if changed else stored)


def reproduce(config: SceneConfig) -> tuple[Difference, ...]:
    """Drop the objects of a settled arrangement again and compare, bit for bit.

    Args:
        config: A configuration with a settled arrangement.

    Returns:
        The objects that come to lie elsewhere, or have changed; empty if all is the same.

    Raises:
        SceneError: If the simulation became unstable.
    """
    arrangement = config.arranged
    assert arrangement is not None and arrangement.is_settled
    layout = _undropped(arrangement, config)
    composed = layout.composed
    stored, qpos = stored_qpos(arrangement, composed), drop_again(arrangement, composed)
    changed = _changed_objects(arrangement, layout)
    return _differences(arrangement, stored, qpos, composed, changed)


def describe(arrangement: Arrangement, difference: Difference) -> str:
    """Say in one line what differs, by how much, and what that means."""
    what = (
        "has another shape or mass than when it was settled"
        if difference.is_changed
        else f"settled with mujoco {arrangement.mujoco}, this is {mujoco.__version__}; "
        "the stored pose is used"
    )
    return (
        f"Arrangement {arrangement.name!r}: {difference.name} comes to lie "
        f"{difference.moved_m * 1000:.3f} mm from its stored pose ({what})."
    )


def arranged_goal(arrangement: Arrangement) -> Goal:
    """Return the goal of an arrangement."""
    goal = arrangement.goal
    place = None
    if goal.relation is not None:
        place = PlaceGoal(relation=goal.relation, references=goal.references)
    return Goal(text=goal.text, targets=goal.targets, place=place)


def stored_qpos(arrangement: Arrangement, composed: ComposedScene) -> np.ndarray:
    """Return the state (nq,) with every object at its stored pose, the robot at home.

    Args:
        arrangement: A settled one.
        composed: Its scene.

    Returns:
        The state.
    """
    qpos = home_state(composed.model).qpos.copy()
    for item, body in zip(arrangement.objects, composed.bodies, strict=True):
        assert item.settled is not None
        qpos[body.qpos] = [*item.settled.position_m, *item.settled.quat_wxyz]
    return qpos


def drop_again(arrangement: Arrangement, composed: ComposedScene) -> np.ndarray:
    """Drop every object once from its stored drop pose and return the state (nq,) at rest.

    Args:
        arrangement: The arrangement.
        composed: Its scene.

    Returns:
        The state; objects may have left the workspace.

    Raises:
        SceneError: If the simulation became unstable.
    """
    drops = [_drop(item.drop) for item in arrangement.objects]
    return fall(composed, drops, SceneConfig(arrangement=arrangement).kind)


def record_layout(layout: Layout) -> tuple[ArrangedObject, ...]:
    """Write down a layout as objects of an arrangement.

    Args:
        layout: A settled layout in which every object fell once.

    Returns:
        The objects, with drop poses, poses at rest and fingerprints.
    """
    return tuple(
        ArrangedObject(
            name=body.name,
            object=asset.name,
            drop=_pose(drop.position, drop.quat_wxyz),
            settled=_pose(layout.qpos[body.qpos][:3], layout.qpos[body.qpos][3:]),
            fingerprint=fingerprint(asset),
        )
        for asset, body, drop in zip(
            layout.assets, layout.composed.bodies, layout.drops, strict=True
        )
    )


def _undropped(arrangement: Arrangement, config: SceneConfig) -> Layout:
    """Load and compose the objects; where they lie is not known yet, `qpos` is empty."""
    catalogue = open_catalogue(config.catalogue)
    assets = tuple(catalogue.load(item.object) for item in arrangement.objects)
    return Layout(
        assets=assets,
        composed=compose_scene(assets, config.cameras),
        qpos=np.zeros(0),
        drops=tuple(_drop(item.drop) for item in arrangement.objects),
    )


def _pose(position: np.ndarray, quat: np.ndarray) -> Pose:
    return Pose(position_m=tuple(position.tolist()), quat_wxyz=tuple(quat.tolist()))


def _drop(pose: Pose) -> Drop:
    return Drop(position=np.array(pose.position_m), quat_wxyz=np.array(pose.quat_wxyz))


def _drop_and_recover(config: SceneConfig, layout: Layout) -> np.ndarray:
    rng = np.random.default_rng(config.seed)
    qpos = fall(layout.composed, layout.drops, config.kind, rng)
    if not stays(layout.composed, qpos, config.kind):
        raise SceneError(
            f"The objects of {config.title!r} do not stay as they were dropped; use another seed."
        )
    return qpos


def _changed_objects(arrangement: Arrangement, layout: Layout) -> frozenset[str]:
    return frozenset(
        item.name
        for item, asset in zip(arrangement.objects, layout.assets, strict=True)
        if item.fingerprint is None or not matches(asset, item.fingerprint)
    )


def _differences(
    arrangement: Arrangement,
    stored: np.ndarray,
    qpos: np.ndarray,
    composed: ComposedScene,
    changed: frozenset[str],
) -> tuple[Difference, ...]:
    found = []
    for body in composed.bodies:
        before, now = stored[body.qpos], qpos[body.qpos]
        if body.name in changed or before.tobytes() != now.tobytes():
            moved = float(np.linalg.norm(now[:3] - before[:3]))
            found.append(Difference(name=body.name, moved_m=moved, is_changed=body.name in changed))
    return tuple(found)
