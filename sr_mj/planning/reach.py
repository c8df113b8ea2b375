"""A verdict on the reachability of many candidates at once."""

import numpy as np

from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.closed_form import NUM_BRANCHES, solve_closed_form
from sr_mj.planning.clearance import Clearance
from sr_mj.planning.config import PlannerConfig
from sr_mj.planning.straight import moved

_UP = np.array([0.0, 0.0, 1.0])
# No straight way of a tenth of a metre turns a joint by more, unless the arm flips.
_LARGEST_SWING = 1.5


def find_reachable(
    candidates: ActionCandidates, clearance: Clearance, config: PlannerConfig
) -> np.ndarray:
    """Check the pose and a few poses on the straight ways to and from it.

    Args:
        candidates: K poses.
        clearance: Measures postures; without the gripper, which is near the cloud on purpose.
        config: Lengths of the ways and margins.

    Returns:
        (K,) mask of the candidates for which one branch of postures passes.
    """
    poses = candidates.Ts_world_tool
    back = moved(poses, -poses[:, :3, 2], config.approach_m)
    above = moved(poses, _UP, config.lift_m if candidates.kind == "pick" else config.approach_m)
    halfway = [poses.copy(), poses.copy()]
    for middle, end in zip(halfway, (back, above), strict=True):
        middle[:, :3, 3] = (poses[:, :3, 3] + end[:, :3, 3]) / 2
    keys = np.stack([poses, back, above, *halfway], axis=1)
    shape = (*keys.shape[:2], NUM_BRANCHES, 6)
    solved = solve_closed_form(keys.reshape(-1, 4, 4)).reshape(shape)
    swing = solved - solved[:, :1]
    swing -= 2 * np.pi * np.round(swing / (2 * np.pi))
    # NaN, where a branch does not reach a pose, compares false.
    is_open = np.abs(swing).max(axis=(1, 3)) <= _LARGEST_SWING
    travel = np.where(is_open, np.abs(solved[:, 0] - HOME_QPOS).max(axis=2), np.inf)
    ranked = np.argsort(travel, axis=1, kind="stable")
    reached = np.zeros(len(poses), bool)
    for branch in ranked.T:
        rows = np.flatnonzero(~reached & is_open[np.arange(len(poses)), branch])
        postures = solved[rows, :, branch[rows]]
        clear = clearance.measure(postures.reshape(-1, 6)).reshape(-1, keys.shape[1])
        reached[rows] = clear.min(axis=1, initial=np.inf) >= config.least_margin_m
    return reached
