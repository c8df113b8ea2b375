"""Which candidates cannot be approached by the straight joint motion: the label a_col."""

import numpy as np

from policy.actions import ActionCandidates
from sr_mj.candidates.held import HeldObject
from sr_mj.closed_form import solve_closed_form
from sr_mj.planning.body import RobotBody
from sr_mj.planning.clearance import Clearance, held_spheres
from sr_mj.planning.config import PlannerConfig
from sr_mj.planning.obstacles import find_obstacles
from sr_mj.planning.straight import moved

_NUM_STEPS = 14
_SLACK_M = 0.002
# The gripper looks the same turned by half a turn about its approach direction.
_HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
_UP = np.array([0.0, 0.0, 1.0])


def needs_detour(
    candidates: ActionCandidates,
    config: PlannerConfig,
    body: RobotBody,
    obstacles: np.ndarray,
    start: np.ndarray,
    held: HeldObject | None = None,
) -> np.ndarray:
    """Tell for which candidates the straight joint motion to the approach's start collides.

    The motion ends where the planner's straight way begins (behind a grasp, over a place), in the
    posture nearest to the start. It collides if it comes nearer to the cloud than the planner lets
    free motions come, if robot, table and bin meet, or if it leads where the arm cannot be.

    Args:
        candidates: K poses of either kind.
        config: The planner's geometry and margins.
        body: Places the robot.
        obstacles: (N, 3) points of the cloud.
        start: (6,) posture where the arm is, rad.
        held: The object in the gripper.

    Returns:
        (K,) float32, 1 where a detour is needed, else 0.
    """
    away = -candidates.Ts_world_tool[:, :3, 2] if candidates.kind == "pick" else _UP
    before = moved(candidates.Ts_world_tool, away, config.approach_m)
    ends = _nearest_postures(before, start, can_turn=candidates.kind == "pick")
    field = find_obstacles(obstacles)
    # The gripper's spheres are larger than the gripper; those of what it holds are not.
    parts = [(Clearance(body=body, obstacles=field), config.least_margin_m)]
    if held is not None:
        points = held_spheres(held.points_tool)
        loaded = Clearance(body=body, obstacles=field, held_points=points, with_gripper=False)
        parts.append((loaded, -config.touch_m))
    share = np.linspace(0, 1, _NUM_STEPS + 1)[1:]
    paths = start + share[:, None] * (ends[:, None] - start)
    # A posture beyond the arm's reach is NaN, which no straight motion leads to.
    is_solved = np.asarray(np.isfinite(ends).all(axis=1))
    is_blocked = ~is_solved
    for clearance, least_m in parts:
        clear = clearance.measure(paths[is_solved].reshape(-1, 6)).reshape(-1, _NUM_STEPS)
        margin = np.minimum(config.margin_m, clear[:, -1] - _SLACK_M)
        is_blocked[is_solved] |= (clear.min(axis=1) < margin) | (clear[:, -1] < least_m)
    return np.asarray(is_blocked, np.float32)


def _nearest_postures(poses: np.ndarray, start: np.ndarray, *, can_turn: bool) -> np.ndarray:
    """Return for each pose (K, 4, 4) the posture (K, 6) that is the least motion away."""
    options = [solve_closed_form(poses, start)]
    if can_turn:
        options.append(solve_closed_form(poses @ _HALF_TURN, start))
    solved = np.concatenate(options, axis=1)
    travel = np.abs(solved - start).max(axis=2)
    nearest = np.where(np.isnan(travel), np.inf, travel).argmin(axis=1)
    return solved[np.arange(len(poses)), nearest]
