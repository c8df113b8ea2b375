"""Plans one pick: home, pre-grasp, grasp along the approach, lift, bin, a tilt there, home."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.ur5 import HOME_QPOS
from sr_mj.closed_form import solve_closed_form
from sr_mj.planning.clearance import gripper_hits
from sr_mj.planning.motion import FreePath
from sr_mj.planning.plan import Phase
from sr_mj.planning.straight import moved, solve_ways, straight_poses
from sr_mj.planning.task import Draft, DraftBuilder, PlanningTask, first_draft
from sr_mj.planning.tilt import plan_tilt

_UP = np.array([0.0, 0.0, 1.0])
# The gripper looks the same turned by half a turn about its approach direction.
_HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
_MAX_BIN_POSTURES = 3
_LARGEST_RISE_RAD = 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class _Reach:
    """One way to a grasp and up from it: joint paths that begin at the grasp."""

    back: np.ndarray
    lift: np.ndarray
    above: list[np.ndarray]


def plan_pick(
    task: PlanningTask, T_world_tool: np.ndarray, width_m: float, *, shake_off: bool = False
) -> Draft | None:
    """Plan a pick.

    Args:
        task: Robot and surroundings.
        T_world_tool: (4, 4) grasp pose.
        width_m: Contact width, metres.
        shake_off: Whether to tilt what is held over the bin.

    Returns:
        The draft, or None if the grasp can't be reached, or not be left, without collision.
    """
    config = task.config
    opening_m = min(width_m + config.extra_width_m, ROBOTIQ_2F85_CLASS.max_width_m)
    pre_grasp = moved(T_world_tool, -T_world_tool[:3, 2], config.approach_m)
    back = straight_poses(T_world_tool, pre_grasp, config.step_m)
    if gripper_hits(task.obstacles, back, opening_m, config.touch_m):
        return None
    return first_draft(
        _reaches(task, T_world_tool, back),
        lambda reach, may_search: _join(task, reach, opening_m, shake_off, may_search),
    )


def _reaches(task: PlanningTask, T_world_tool: np.ndarray, back: np.ndarray) -> Iterator[_Reach]:
    """Yield the ways on which the arm keeps clear, those that cost the least motion first."""
    config = task.config
    lift = straight_poses(T_world_tool, moved(T_world_tool, _UP, config.lift_m), config.step_m)
    ways = solve_ways([back, lift], task.start, config.max_joint_step, np.pi)
    outs, ups = ways.postures
    transit = np.abs(outs[:, -1] - task.start).max(axis=1)
    for i in np.argsort(transit + _leaving(task, ups[:, -1]).min(axis=1), kind="stable"):
        clear = task.links.measure(np.concatenate([outs[i], ups[i]]))
        if clear.min() < config.least_margin_m:
            continue
        turn = _HALF_TURN if ways.turns[i] % 2 else np.eye(4)
        paths = [task.follow(way @ turn, outs[i, 0]) for way in (back, lift)]
        if paths[0] is not None and paths[1] is not None:
            above = _above(task, back[-1] @ turn, paths[0][-1])
            yield _Reach(back=paths[0], lift=paths[1], above=above)


def _above(task: PlanningTask, pre_grasp: np.ndarray, posture: np.ndarray) -> list[np.ndarray]:
    """Find the posture straight over a pre-grasp at which the arm is over the heap, if any."""
    rise = max(task.config.transit_height_m - pre_grasp[2, 3], 0.0)
    options = solve_closed_form(moved(pre_grasp, _UP, rise), posture)[0]
    gaps = np.abs(options - posture).max(axis=1)
    # A branch without solution is NaN, which compares false.
    return list(options[gaps < _LARGEST_RISE_RAD][:1])


def _join(
    task: PlanningTask, reach: _Reach, opening_m: float, shake_off: bool, may_search: bool
) -> Draft | None:
    """Join the straight ways of a reach by free motions."""
    config = task.config
    transit = task.motions.connect(
        task.start,
        reach.back[-1],
        task.robot,
        via=reach.above,
        # Without a cloud nobody knows what stands in the direct way.
        may_go_direct=task.obstacles is not None,
        may_search=may_search,
    )
    if transit is None:
        return None
    leave = _leave(task, reach.lift[-1], may_search)
    if leave is None:
        return None
    carry, home = leave
    build = DraftBuilder(config)
    build.move(Phase.TRANSIT, transit, 1.0, opening_m)
    build.move(Phase.APPROACH, reach.back[::-1], config.approach_speed, opening_m)
    build.set_width(Phase.CLOSE, 0.0)
    build.move(Phase.LIFT, reach.lift, config.approach_speed, 0.0)
    build.move(Phase.CARRY, carry, config.carry_speed, 0.0)
    tilt = plan_tilt(task, carry.waypoints[-1]) if shake_off else None
    if tilt is not None:
        build.move(Phase.TILT, tilt, config.carry_speed, 0.0)
    build.set_width(Phase.RELEASE, ROBOTIQ_2F85_CLASS.max_width_m)
    build.move(Phase.RETURN, home, 1.0, 0.0)
    return build.finish()


def _leaving(task: PlanningTask, lifted: np.ndarray) -> np.ndarray:
    """Joint motion (L, O) from postures (L, 6) over each posture over the bin to home, rad."""
    carry = np.abs(task.over_bin - lifted[:, None]).max(axis=2) / task.config.carry_speed
    return carry + np.abs(task.over_bin - HOME_QPOS).max(axis=1)


def _leave(
    task: PlanningTask, lifted: np.ndarray, may_search: bool
) -> tuple[FreePath, FreePath] | None:
    """Find free motions to the nearest posture over the bin, and home from there."""
    order = np.argsort(_leaving(task, lifted[None])[0], kind="stable")
    for over_bin in task.over_bin[order[:_MAX_BIN_POSTURES]]:
        carry = task.motions.connect(lifted, over_bin, task.robot, may_search=may_search)
        if carry is not None:
            home = task.motions.connect(over_bin, HOME_QPOS, task.robot, may_search=may_search)
            if home is not None:
                return carry, home
    return None
