"""Takes the robot out of what its cameras see: it knows where it is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.workspace import Workspace
from perception.views import CameraView
from sr_mj.planning.body import RobotBody

_MARGIN_M = 0.03
"""The links' covers stand out from the capsules that stand for them, and depth has noise."""


def hide_robot(
    views: Sequence[CameraView], robot: RobotBody, arm_qpos: np.ndarray, workspace: Workspace
) -> tuple[CameraView, ...]:
    """Remove the depth of pixels that show the arm over the workspace.

    While something is held over the bin, the elbow stands over the edge of the larger workspace.

    Args:
        views: Views from the same moment.
        robot: Places the robot.
        arm_qpos: (6,) joint angles of the arm at that moment, rad.
        workspace: Where it matters; pixels that show the arm elsewhere are left.

    Returns:
        The views; the same objects if the arm is not over the workspace.
    """
    centers, radius_m = robot.place(arm_qpos[None]).centers[0], robot.radius_m + _MARGIN_M
    inside = np.all(
        (centers + radius_m[:, None] > workspace.lower)
        & (centers - radius_m[:, None] < workspace.upper),
        axis=1,
    )
    if not inside.any():
        return tuple(views)
    return tuple(_hide(view, centers[inside], radius_m[inside]) for view in views)


def _hide(view: CameraView, centers: np.ndarray, radius_m: np.ndarray) -> CameraView:
    """Set the depth of pixels whose points lie in spheres (S) to 0, no return."""
    intrinsics, pose = view.intrinsics, view.T_world_cam_cv
    depth = np.array(view.depth_m)
    focal = np.array([intrinsics.fx, intrinsics.fy])
    middle = np.array([intrinsics.cx, intrinsics.cy])
    for center, radius in zip((centers - pose[:3, 3]) @ pose[:3, :3], radius_m, strict=True):
        nearest = center[2] - radius
        if nearest <= 0:
            continue
        # A square that surely holds the sphere's image.
        pixel, half = center[:2] / center[2] * focal + middle, radius / nearest * focal
        half = half + np.abs(center[:2]) / center[2] * half
        low = np.clip(np.floor(pixel - half), 0, [intrinsics.width, intrinsics.height]).astype(int)
        high = np.clip(np.ceil(pixel + half), 0, [intrinsics.width, intrinsics.height]).astype(int)
        window = depth[low[1] : high[1], low[0] : high[0]]
        u, v = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        x = (u - middle[0]) / focal[0] * window - center[0]
        y = (v - middle[1]) / focal[1] * window - center[1]
        window[x**2 + y**2 + (window - center[2]) ** 2 < radius**2] = 0
    return replace(view, depth_m=depth)
