"""Straight ways of the tool, and the postures that follow them."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from sr_mj.closed_form import JOINT_LIMITS, NUM_BRANCHES, solve_closed_form


def straight_poses(T_start: np.ndarray, T_end: np.ndarray, step_m: float) -> np.ndarray:
    """Interpolate between two poses: straight in position, shortest in rotation.

    Args:
        T_start: (4, 4).
        T_end: (4, 4).
        step_m: Largest distance between two poses, metres.

    Returns:
        (P, 4, 4) poses, both ends included, P >= 2.
    """
    num = max(int(np.ceil(np.linalg.norm(T_end[:3, 3] - T_start[:3, 3]) / step_m)), 1) + 1
    u = np.linspace(0, 1, num)
    poses = np.tile(np.eye(4), (num, 1, 1))
    poses[:, :3, 3] = T_start[:3, 3] + u[:, None] * (T_end[:3, 3] - T_start[:3, 3])
    ends = Rotation.from_matrix(np.stack([T_start[:3, :3], T_end[:3, :3]]))
    poses[:, :3, :3] = Slerp([0, 1], ends)(u).as_matrix()
    return poses


def moved(T_world_tool: np.ndarray, direction: np.ndarray, by_m: float) -> np.ndarray:
    """Move a pose (4, 4), or several (..., 4, 4), along a world direction (..., 3)."""
    poses = np.array(T_world_tool, float)
    poses[..., :3, 3] += by_m * direction
    return poses


@dataclass(frozen=True, kw_only=True, eq=False)
class Ways:
    """Closed-form postures along straight ways that all begin at one pose.

    Attributes:
        postures: For every way (B, P, 6) joint angles, rad; B branches, the same for all ways.
        turns: (B,) by how many turns about the approach the tool stands off the poses.
    """

    postures: tuple[np.ndarray, ...]
    turns: np.ndarray


def solve_ways(
    ways: list[np.ndarray], reference: np.ndarray, max_joint_step: float, turn: float
) -> Ways:
    """Find the postures that follow straight ways without a jump.

    Args:
        ways: (P, 4, 4) poses each, all with the same first pose.
        reference: (6,) posture; branches that end near it, on the first way, come first.
        max_joint_step: Largest joint motion between two poses, rad.
        turn: Angle about the approach after which the gripper is as good as before, rad: pi for
            an empty one, 2 pi for one that holds something.

    Returns:
        The branches that follow every way within the joint limits.
    """
    solved = solve_closed_form(np.concatenate(ways), reference)
    ends = np.cumsum([len(way) for way in ways])[:-1]
    paths = [np.swapaxes(part, 0, 1) for part in np.split(solved, ends)]
    first = paths[0][:, 0]
    # The last joint may start at other turns, too.
    turns = np.tile(np.arange(-2, 3), NUM_BRANCHES)
    branch = np.repeat(np.arange(NUM_BRANCHES), 5)
    starts = first[branch]
    starts[:, 5] += turn * turns
    continued = [_continue(path[branch], starts) for path in paths]
    is_good = np.ones(len(starts), bool)
    for path in continued:
        steps = np.abs(np.diff(path, axis=1)).max(axis=(1, 2), initial=0.0)
        # A comparison with NaN is false.
        is_good &= (steps <= max_joint_step) & (np.abs(path) <= JOINT_LIMITS).all(axis=(1, 2))
    rows = np.flatnonzero(is_good)
    travel = np.abs(continued[0][rows, -1] - reference).max(axis=1)
    rows = rows[np.argsort(travel, kind="stable")]
    return Ways(postures=tuple(path[rows] for path in continued), turns=turns[rows])


def _continue(paths: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Choose full turns such that paths (B, P, 6) go on from starts (B, 6) without a jump."""
    steps = np.diff(paths, axis=1)
    steps -= 2 * np.pi * np.round(steps / (2 * np.pi))
    return np.concatenate([starts[:, None], starts[:, None] + np.cumsum(steps, axis=1)], axis=1)
