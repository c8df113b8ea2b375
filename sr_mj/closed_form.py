"""Closed-form inverse kinematics of the UR5, for many poses at once.

Three parallel joints (shoulder lift, elbow, wrist 1) and three wrist axes that cross in pairs give
the arm up to eight postures for a pose: two of the shoulder, two of the wrist, two of the elbow.
It is the solution that K. P. Hawkins, "Analytic Inverse Kinematics for the Universal Robots
UR-5/UR-10 Arms" (Georgia Institute of Technology, 2013, https://hdl.handle.net/1853/50782)
describes, derived anew in the frames of the URDF.
"""

import itertools

import numpy as np

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.ur5 import HOME_QPOS

NUM_BRANCHES = 8
"""Postures that a pose may have."""

# Lengths of the UR5's links, metres, by the data sheet's Denavit-Hartenberg names; the tool
# extends the last one along its axis.
_D1, _A2, _A3, _D4, _D5, _D6 = 0.089159, 0.425, 0.39225, 0.10915, 0.09465, 0.0823
_D_TOOL = _D6 + ROBOTIQ_2F85_CLASS.flange_to_tool_m
_UPPER = 2 * np.pi * np.ones(6)
_UPPER[2] = np.pi
_UPPER.setflags(write=False)
JOINT_LIMITS = _UPPER
"""(6,) largest joint angle to either side, rad."""


def solve_closed_form(Ts_world_tool: np.ndarray, reference: np.ndarray = HOME_QPOS) -> np.ndarray:
    """Find every posture of the arm that puts the tool at given poses.

    Args:
        Ts_world_tool: (M, 4, 4) poses.
        reference: (6,) posture, rad. Of the full turns that the joint limits allow, the one
            nearest to it is returned.

    Returns:
        (M, 8, 6) joint angles, rad, within the joint limits. A branch has the same number for
        every pose: the shoulder's choice counts 4, the wrist's 2, the elbow's 1. NaN where a
        branch does not reach the pose, and where the last joint is parallel to the lift joints,
        so that there is no single answer.
    """
    poses = np.asarray(Ts_world_tool, float).reshape(-1, 4, 4)
    solutions = np.empty((len(poses), NUM_BRANCHES, 6))
    with np.errstate(invalid="ignore", divide="ignore"):
        choices = itertools.product((False, True), repeat=3)
        for branch, (shoulder, wrist, elbow) in enumerate(choices):
            solutions[:, branch] = _solve_branch(poses, shoulder, wrist, elbow)
    solutions[~np.isfinite(solutions).all(axis=2)] = np.nan
    return nearest_turns(solutions, np.asarray(reference, float))


def nearest_turns(qpos: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Add full turns to joint angles, towards a reference, within the joint limits.

    Args:
        qpos: (..., 6) joint angles, rad.
        reference: Joint angles that broadcast against them.

    Returns:
        (..., 6) joint angles, rad.
    """
    turn = 2 * np.pi
    reference = np.clip(reference, -JOINT_LIMITS, JOINT_LIMITS)
    near = qpos + turn * np.round((reference - qpos) / turn)
    near = np.where(near > JOINT_LIMITS, near - turn, near)
    return np.where(near < -JOINT_LIMITS, near + turn, near)


def _solve_branch(poses: np.ndarray, shoulder: bool, wrist: bool, elbow: bool) -> np.ndarray:
    """Solve one branch; joint angles (M, 6) up to full turns, not finite where there is none."""
    closing, approach = poses[:, :3, 0], poses[:, :3, 2]
    # The origin of the last link lies beside the plane of the arm, always equally far.
    last = poses[:, :3, 3] - _D_TOOL * approach
    bearing = np.arctan2(last[:, 1], last[:, 0])
    aside = np.arcsin(_D4 / np.hypot(last[:, 0], last[:, 1]))
    pan = bearing + aside - np.pi if shoulder else bearing - aside
    zero, one = np.zeros(len(poses)), np.ones(len(poses))
    radial = np.stack([np.cos(pan), np.sin(pan), zero], axis=1)
    lateral = np.stack([-np.sin(pan), np.cos(pan), zero], axis=1)

    cos_5 = _dot(approach, lateral).clip(-1, 1)
    wrist_2 = np.arccos(cos_5) * (-1 if wrist else 1)
    # The axis of the fifth joint is normal to the lift joints and to the approach.
    axis = np.cross(lateral, approach) / np.sin(wrist_2)[:, None]
    across = np.cross(lateral, axis) * cos_5[:, None] + np.sin(wrist_2)[:, None] * lateral
    wrist_3 = np.arctan2(-_dot(closing, axis), _dot(closing, across))
    sum_234 = np.arctan2(-_dot(axis, radial), -axis[:, 2])

    # What remains is two links in the plane of the arm; downwards counts positive.
    ahead = _dot(last - _D5 * axis, radial)
    down = _D1 + _D5 * axis[:, 2] - last[:, 2]
    cos_3 = (ahead**2 + down**2 - _A2**2 - _A3**2) / (2 * _A2 * _A3)
    bend = np.arccos(np.where(np.abs(cos_3) <= one, cos_3, np.nan)) * (-1 if elbow else 1)
    lift = np.arctan2(down, ahead) - np.arctan2(_A3 * np.sin(bend), _A2 + _A3 * np.cos(bend))
    return np.stack([pan, lift, bend, sum_234 - lift - bend, wrist_2, wrist_3], axis=1)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("mi,mi->m", a, b)
