"""From depth pixels to points: filtered, cropped to a box, with what each pixel knows besides."""

from typing import Protocol

import numpy as np

from perception.depth_filter import filter_depth
from perception.views import CameraView


class CropConfig(Protocol):
    """The part of `perception.fusion.FusionConfig` that concerns single views."""

    @property
    def workspace_min(self) -> tuple[float, float, float]:
        """Lower corner of the crop, world, metres."""
        ...

    @property
    def workspace_max(self) -> tuple[float, float, float]:
        """Upper corner of the crop, world, metres."""
        ...

    @property
    def flying_pixel_tolerance_m(self) -> float:
        """Depth step between neighbouring pixels of one surface."""
        ...

    @property
    def flying_pixel_neighbours(self) -> int:
        """Neighbours, of 8, that must lie within that step."""
        ...

    @property
    def is_depth_smoothed(self) -> bool:
        """Average each pixel with the neighbours of its own surface."""
        ...


def back_project(view: CameraView, config: CropConfig) -> tuple[np.ndarray, np.ndarray]:
    """Turn the depth pixels of a view whose points lie inside the workspace into points.

    Args:
        view: The view.
        config: Workspace and filter.

    Returns:
        (3, N) float32 coordinates of points, world, metres, and (3, N) float32 colours, 0..1: one
        row an axis, which is how averaging over voxels reads them.
    """
    window, depth_m = _filtered_window(view, config)
    grid = _grid_points(view, depth_m, window)
    # Taking by number is ten times as fast as by mask.
    chosen = np.flatnonzero(_inside(grid, depth_m, config))
    points = np.take(grid.reshape(3, -1), chosen, axis=1)
    pixels = np.ascontiguousarray(view.rgb[window]).reshape(-1, 3)
    colors = np.take(pixels, chosen, axis=0).T.astype(np.float32, order="C") / np.float32(255.0)
    return points, colors


def filter_view_depth(view: CameraView, config: CropConfig) -> np.ndarray:
    """Return the depth image of a view as `back_project` uses it.

    Args:
        view: The view.
        config: Workspace and filter.

    Returns:
        (H, W) float32, metres; 0 where there is no return, a flying pixel, or a point outside the
        workspace.
    """
    window, filtered_m = _filtered_window(view, config)
    depth_m = np.zeros_like(view.depth_m)
    is_inside = _inside(_grid_points(view, filtered_m, window), filtered_m, config)
    depth_m[window] = np.where(is_inside, filtered_m, np.float32(0.0))
    return depth_m


def _filtered_window(
    view: CameraView, config: CropConfig
) -> tuple[tuple[slice, slice], np.ndarray]:
    """Return the part of the image that shows the workspace, and its filtered depth."""
    everything = (slice(0, view.intrinsics.height), slice(0, view.intrinsics.width))
    coarse = _inside(_grid_points(view, view.depth_m, everything), view.depth_m, config)
    rows, columns = np.flatnonzero(coarse.any(axis=1)), np.flatnonzero(coarse.any(axis=0))
    if len(rows) == 0:
        return (slice(0, 0), slice(0, 0)), np.zeros((0, 0), np.float32)
    # Filtering is the dear part: only the rectangle around the workspace, with its neighbours.
    v, u = max(rows[0] - 1, 0), max(columns[0] - 1, 0)
    window = (slice(v, rows[-1] + 2), slice(u, columns[-1] + 2))
    depth_m = filter_depth(
        view.depth_m[window],
        tolerance_m=config.flying_pixel_tolerance_m,
        min_neighbours=config.flying_pixel_neighbours,
        is_smoothed=config.is_depth_smoothed,
    )
    return window, depth_m


def _grid_points(view: CameraView, depth_m: np.ndarray, window: tuple[slice, slice]) -> np.ndarray:
    """Return (3, h, w) world points of a window of a depth image."""
    K = view.intrinsics
    height, width = depth_m.shape
    v0, u0 = window[0].start, window[1].start
    x = ((np.arange(u0, u0 + width) - K.cx) / K.fx).astype(np.float32)
    y = ((np.arange(v0, v0 + height) - K.cy) / K.fy).astype(np.float32)[:, None]
    T = view.T_world_cam_cv.astype(np.float32)
    axes = [depth_m * (T[i, 0] * x + T[i, 1] * y + T[i, 2]) + T[i, 3] for i in range(3)]
    return np.stack(axes)


def _inside(grid: np.ndarray, depth_m: np.ndarray, config: CropConfig) -> np.ndarray:
    """Return (h, w) bool: the pixel has depth and its point lies inside the workspace."""
    is_inside = depth_m > 0
    for axis, low, high in zip(grid, config.workspace_min, config.workspace_max, strict=True):
        is_inside &= (axis >= low) & (axis <= high)
    return is_inside
