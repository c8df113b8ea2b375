"""Tilts what is held over the bin, so that whatever lies on it slides off."""

import numpy as np
from scipy.spatial.transform import Rotation

from sr_mj.planning.task import PlanningTask

_STEP_RAD = 0.09


def plan_tilt(task: PlanningTask, over_bin: np.ndarray) -> np.ndarray | None:
    """Plan to turn the tool on the spot, about the line through both pads, and back.

    About that line neither finger gets under what is to slide off. The bin is beside the arm, so
    that only one way is within its reach: the wrist towards the robot, the fingertips outwards.

    Args:
        task: Robot and surroundings.
        over_bin: (6,) one of the postures over the bin, where the pads face each other along the
            world's x axis.

    Returns:
        (W, 6) joint angles, rad, from the posture to the posture; None if the arm cannot, or comes
        too near to something.
    """
    angles = np.linspace(0, -task.config.tilt_rad, int(task.config.tilt_rad / _STEP_RAD) + 2)
    poses = np.tile(task.kinematics.tool_pose(over_bin), (len(angles), 1, 1))
    turns = Rotation.from_rotvec(angles[:, None] * [1, 0, 0])
    poses[:, :3, :3] = turns.as_matrix() @ poses[0, :3, :3]
    path = task.follow(poses, over_bin)
    if path is None or task.robot.measure(path).min() < task.config.least_margin_m:
        return None
    return np.concatenate([path, path[-2::-1]])
