"""What comes down on the scene, as vertical columns: the held object, and the open gripper."""

from dataclasses import dataclass

import numpy as np

from sr_mj.candidates.collision import swept_boxes
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.surface import voxel_keys


@dataclass(frozen=True, kw_only=True, eq=False)
class Columns:
    """A body's lower and upper side, seen from above; axes as the world's, origin at the tool's.

    Attributes:
        xy: (C, 2) middle of each column, metres.
        bottom_m: (C,) its lowest point.
        top_m: (C,) its highest point.
    """

    xy: np.ndarray
    bottom_m: np.ndarray
    top_m: np.ndarray

    @property
    def center(self) -> np.ndarray:
        """(2,) centre of the volume between both sides, metres."""
        thickness = self.top_m - self.bottom_m + 1e-3
        return (self.xy * thickness[:, None]).sum(axis=0) / thickness.sum()

    def turned(self, yaw: float) -> np.ndarray:
        """Return the middles (C, 2) after a turn about the vertical by `yaw`, radians."""
        cos, sin = np.cos(yaw), np.sin(yaw)
        return self.xy @ np.array([[cos, sin], [-sin, cos]])


def columns_of(points: np.ndarray, edge_m: float) -> Columns:
    """Divide points into columns.

    Args:
        points: (N, 3) positions, metres, N > 0.
        edge_m: Edge of a column.

    Returns:
        The columns that hold points.
    """
    keys = voxel_keys(points[:, :2], edge_m)
    order = np.argsort(keys, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(keys[order]) != 0])
    cells = np.floor(points[order[starts], :2] / edge_m)
    heights = points[order, 2]
    return Columns(
        xy=(cells + 0.5) * edge_m,
        bottom_m=np.minimum.reduceat(heights, starts),
        top_m=np.maximum.reduceat(heights, starts),
    )


def gripper_columns(
    rotation: np.ndarray, opening_m: float, config: AntipodalConfig, edge_m: float
) -> Columns:
    """Describe the gripper and the arm's last link from below.

    Args:
        rotation: (3, 3) orientation of the tool in the world.
        opening_m: Distance between the pads.
        config: The gripper's boxes.
        edge_m: Edge of a column.

    Returns:
        The columns.
    """
    low, high = swept_boxes(np.array([opening_m]), config)
    low, high = low[0].astype(float), high[0].astype(float)
    # The boxes of palm and wrist reach back over an approach along the tool's axis; here it comes
    # down vertically, and needs them as they are.
    low[2:, 2] += config.pregrasp_m
    points = [_box_surface(*corners, edge_m / 2) for corners in zip(low, high, strict=True)]
    return columns_of(np.concatenate(points) @ rotation.T, edge_m)


def _box_surface(low: np.ndarray, high: np.ndarray, step_m: float) -> np.ndarray:
    """Sample the six faces of a box on grids (P, 3)."""
    axes = [
        np.linspace(a, b, int(np.ceil((b - a) / step_m)) + 1)
        for a, b in zip(low, high, strict=True)
    ]
    faces = []
    for axis in range(3):
        for end in (axes[axis][0], axes[axis][-1]):
            grid = np.meshgrid(*(np.array([end]) if k == axis else axes[k] for k in range(3)))
            faces.append(np.stack([part.ravel() for part in grid], axis=1))
    return np.concatenate(faces)
