"""Plans one placement: over the place, straight down, release, back along the tool, home."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.ur5 import HOME_QPOS
from sr_mj.planning.clearance import Clearance, gripper_hits, held_spheres
from sr_mj.planning.plan import Phase
from sr_mj.planning.straight import moved, solve_ways, straight_poses
from sr_mj.planning.task import Draft, DraftBuilder, PlanningTask, first_draft

if TYPE_CHECKING:
    from sr_mj.candidates.held import HeldObject

_UP = np.array([0.0, 0.0, 1.0])
# Largest slope of the closing direction at which neither finger reaches under the object.
_LEVEL = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class _Descent:
    """Joint paths that begin at the place: up to where the descent starts, and back."""

    up: np.ndarray
    back: np.ndarray
    opening_m: float


def plan_place(
    task: PlanningTask, T_world_tool: np.ndarray, width_m: float, held: "HeldObject | None"
) -> Draft | None:
    """Plan a placement.

    Args:
        task: Robot and surroundings.
        T_world_tool: (4, 4) pose of the tool at which the gripper opens.
        width_m: Width of the held object in the gripper, metres.
        held: The held object; only the robot itself is checked when None.

    Returns:
        The draft, or None if the place can't be reached, or not be left, without collision.
    """
    config = task.config
    loaded = Clearance(
        body=task.body,
        obstacles=task.obstacles,
        held_points=np.zeros((0, 3)) if held is None else held_spheres(held.points_tool),
    )
    # The way down is tried from low and from high: a held object may stand out below the tool.
    descents = (
        descent
        for height_m in (config.approach_m, config.lift_m)
        for descent in _descents(task, loaded, T_world_tool, width_m, height_m)
    )
    return first_draft(
        descents, lambda descent, may_search: _join(task, loaded, descent, may_search)
    )


def _way_back(
    task: PlanningTask, T_world_tool: np.ndarray, up: np.ndarray, width_m: float
) -> tuple[np.ndarray, float] | None:
    """Choose how the open gripper leaves: poses (P, 4, 4) and opening; None if it can't.

    In a narrow place the fingers part less. Back along the tool touches nothing that it did not
    touch before; straight up is as good while neither finger is below the object.
    """
    config = task.config
    behind = moved(T_world_tool, -T_world_tool[:3, 2], config.approach_m)
    ways = [straight_poses(T_world_tool, behind, config.step_m)]
    if abs(T_world_tool[2, 0]) < _LEVEL:
        ways.append(up)
    for way in ways:
        for share in (1.0, 0.5):
            wider_m = width_m + share * config.extra_width_m
            opening_m = min(wider_m, ROBOTIQ_2F85_CLASS.max_width_m)
            if not gripper_hits(task.obstacles, way, opening_m, config.touch_m):
                return way, opening_m
    return None


def _descents(
    task: PlanningTask,
    loaded: Clearance,
    T_world_tool: np.ndarray,
    width_m: float,
    height_m: float,
) -> Iterator[_Descent]:
    """Yield the ways on which arm and held object keep clear."""
    config = task.config
    up = straight_poses(T_world_tool, moved(T_world_tool, _UP, height_m), config.step_m)
    if gripper_hits(task.obstacles, up, width_m, config.touch_m):
        return
    left = _way_back(task, T_world_tool, up, width_m)
    if left is None:
        return
    back, opening_m = left
    ways = solve_ways([up, back], task.start, config.max_joint_step, 2 * np.pi)
    in_hand = Clearance(
        body=task.body,
        obstacles=task.obstacles,
        held_points=loaded.held_points,
        with_gripper=False,
    )
    high = np.linalg.norm(up[:, :3, 3] - T_world_tool[:3, 3], axis=1) > config.settle_m
    for postures_up, postures_back in zip(*ways.postures, strict=True):
        links = task.links.measure(np.concatenate([postures_up, postures_back]))
        if links.min() < config.least_margin_m:
            continue
        if in_hand.measure(postures_up[high]).min() < -config.touch_m:
            continue
        paths = [task.follow(way, postures_up[0]) for way in (up, back)]
        if paths[0] is not None and paths[1] is not None:
            yield _Descent(up=paths[0], back=paths[1], opening_m=opening_m)


def _join(
    task: PlanningTask, loaded: Clearance, descent: _Descent, may_search: bool
) -> Draft | None:
    """Join the straight ways of a descent by free motions."""
    config = task.config
    transit = task.motions.connect(task.start, descent.up[-1], loaded, may_search=may_search)
    if transit is None:
        return None
    home = task.motions.connect(
        descent.back[-1], HOME_QPOS, task.robot, via=[descent.up[-1]], may_search=may_search
    )
    if home is None:
        return None
    build = DraftBuilder(config)
    build.move(Phase.TRANSIT, transit, config.carry_speed, 0.0)
    build.move(Phase.LOWER, descent.up[::-1], config.approach_speed, 0.0)
    build.set_width(Phase.RELEASE, descent.opening_m)
    build.move(Phase.RETREAT, descent.back, config.approach_speed, descent.opening_m)
    build.move(Phase.RETURN, home, 1.0, descent.opening_m)
    return build.finish()
