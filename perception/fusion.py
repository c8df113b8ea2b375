"""Fusion of RGB-D views into one geometry cloud (Open3D), reproducibly.

Filter each depth image -> back-project -> crop to the workspace -> average over voxels -> remove
outliers -> estimate normals -> turn them towards the cameras that saw the point.

Averaging over voxels is the default, TSDF integration the alternative; docs/fusion.md compares them
against the true surfaces.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
import open3d as o3d

from perception.back_projection import back_project, filter_view_depth
from perception.cloud import GeometryCloud
from perception.errors import EmptyCloudError, InvalidConfigError, InvalidViewError
from perception.table_plane import TablePrior, above_table
from perception.tsdf import extract_tsdf
from perception.views import CameraView
from perception.voxels import average_rows, voxel_rows

FusionMethod = Literal["voxel_means", "tsdf"]
TableRule = Literal["keep", "remove"]


@dataclass(frozen=True, kw_only=True)
class FusionConfig:
    """Settings of the fusion.

    Attributes:
        workspace_min: Lower corner of the crop, world, metres. It lies a little under the table so
            that the noise of the table's own points is not cut in half.
        workspace_max: Upper corner of the crop, world, metres.
        method: "voxel_means": pixels that share a voxel become their mean. "tsdf": signed distances
            are averaged along the rays; smoother, slower, with holes.
        voxel_size_m: Edge of the voxels over which points, or distances, are averaged.
        min_observations: Pixels that must fall into a voxel; single ones are mostly noise. With
            "tsdf" one view is enough.
        tsdf_truncation_voxels: Reach of the signed distances, in voxels.
        flying_pixel_tolerance_m: Depth step between neighbouring pixels of one surface.
        flying_pixel_neighbours: Neighbours, of 8, that must lie within that step.
        is_depth_smoothed: Average each pixel with the neighbours of its own surface.
        outlier_neighbours: Neighbours whose mean distance the statistical outlier removal looks
            at; 0 switches it off.
        outlier_std_ratio: Points further off than this many standard deviations are removed.
        normal_radius_m: Radius of the patches from which normals are estimated.
        normal_neighbours: Most neighbours in such a patch.
        table: Whether the points of the table stay.
        table_prior: Where to look for the table if it is to be removed.
    """

    workspace_min: tuple[float, float, float] = (0.276, -0.224, -0.01)
    workspace_max: tuple[float, float, float] = (0.724, 0.224, 0.4)
    method: FusionMethod = "voxel_means"
    voxel_size_m: float = 0.002
    min_observations: int = 2
    tsdf_truncation_voxels: float = 4.0
    flying_pixel_tolerance_m: float = 0.01
    flying_pixel_neighbours: int = 4
    is_depth_smoothed: bool = True
    outlier_neighbours: int = 12
    outlier_std_ratio: float = 3.0
    normal_radius_m: float = 0.008
    normal_neighbours: int = 20
    table: TableRule = "keep"
    table_prior: TablePrior = field(default_factory=TablePrior)

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
        if not self.tsdf_truncation_voxels >= 1:
            raise InvalidConfigError(
                f"tsdf_truncation_voxels is {self.tsdf_truncation_voxels}, expected 1 or more."
            )
        if self.method not in get_args(FusionMethod):
            raise InvalidConfigError(
                f"Unknown method {self.method!r}. Methods: {', '.join(get_args(FusionMethod))}."
            )
        if self.table not in get_args(TableRule):
            raise InvalidConfigError(f"table is {self.table!r}, expected 'keep' or 'remove'.")


def fuse(views: Sequence[CameraView], config: FusionConfig) -> GeometryCloud:
    """Fuse views into one cloud. The order of the views does not matter.

    Args:
        views: At least one view, under different names.
        config: Settings.

    Returns:
        The surface that the views saw inside the workspace.

    Raises:
        InvalidViewError: If there is no view, or two share a name.
        EmptyCloudError: If nothing inside the workspace has depth, or nothing but the table does.
    """
    views = ordered_views(views)
    gather = _tsdf_surface if config.method == "tsdf" else _mean_surface
    points, attributes = gather(views, config)
    kept = _inliers(points, config)
    # Normals first: at the foot of an object they need the table around it.
    cloud = _with_normals(points[kept], attributes[kept], config)
    return cloud if config.table == "keep" else _without_table(cloud, config)


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


def _mean_surface(
    views: Sequence[CameraView], config: FusionConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 3) means over voxels, and (N, 6) mean colours and directions to the cameras."""
    parts = [back_project(view, config) for view in views]
    pixels = np.concatenate([part[0] for part in parts], axis=1).T
    if len(pixels) == 0:
        raise EmptyCloudError(_explain_empty(views, config))
    rows, counts = voxel_rows(pixels, config.voxel_size_m)
    colors = np.concatenate([part[1] for part in parts], axis=1).T
    points, colors = average_rows(pixels, rows, counts), average_rows(colors, rows, counts)
    ends = np.cumsum([part[0].shape[1] for part in parts])[:-1]
    shares = [np.bincount(part, minlength=len(counts)) for part in np.split(rows, ends)]
    is_seen = counts >= config.min_observations
    if not is_seen.any():
        raise EmptyCloudError(
            f"None of {len(is_seen)} voxels holds {config.min_observations} pixels or more; lower "
            "min_observations or enlarge voxel_size_m."
        )
    points = points[is_seen]
    towards_cameras = _mean_directions(points, views, [share[is_seen] for share in shares])
    return points, np.concatenate([colors[is_seen], towards_cameras], axis=1)


def _mean_directions(
    points: np.ndarray, views: Sequence[CameraView], weights: Sequence[np.ndarray]
) -> np.ndarray:
    """Return (N, 3) weighted sums of the unit directions from points to cameras."""
    total = np.zeros_like(points)
    for view, weight in zip(views, weights, strict=True):
        direction = view.position.astype(np.float32) - points
        total += (
            direction * (weight / np.linalg.norm(direction, axis=1)).astype(np.float32)[:, None]
        )
    return total


def _tsdf_surface(
    views: Sequence[CameraView], config: FusionConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 3) points where the distance field is zero, and (N, 6) colours and its gradient.

    The gradient points outwards and so orients the normals as directions to the cameras would. The
    normals themselves come from the neighbours as ever: against true ones they are better.
    """
    filtered = [replace(view, depth_m=filter_view_depth(view, config)) for view in views]
    points, attributes = np.zeros((0, 3), np.float32), np.zeros((0, 6), np.float32)
    if any(view.depth_m.any() for view in filtered):
        points, attributes = extract_tsdf(
            filtered,
            voxel_size_m=config.voxel_size_m,
            truncation_voxels=config.tsdf_truncation_voxels,
        )
    low, high = np.asarray([config.workspace_min, config.workspace_max], np.float32)
    is_inside = ((points >= low) & (points <= high)).all(axis=1)
    if not is_inside.any():
        raise EmptyCloudError(_explain_empty(views, config))
    return points[is_inside], attributes[is_inside]


def _inliers(points: np.ndarray, config: FusionConfig) -> np.ndarray:
    """Return (N,) bool: what Open3D's statistical outlier removal keeps."""
    if not 0 < config.outlier_neighbours < len(points):
        return np.ones(len(points), bool)
    kept = np.zeros(len(points), bool)
    _, indices = _legacy_cloud(points).remove_statistical_outlier(
        config.outlier_neighbours, config.outlier_std_ratio
    )
    kept[np.asarray(indices)] = True
    return kept


def _legacy_cloud(points: np.ndarray) -> o3d.geometry.PointCloud:
    # The legacy class finds outliers and normals faster than the tensor class; through the latter
    # it takes float32 without a detour.
    return o3d.t.geometry.PointCloud(o3d.core.Tensor.from_numpy(points)).to_legacy()


def _with_normals(
    points: np.ndarray, attributes: np.ndarray, config: FusionConfig
) -> GeometryCloud:
    cloud = _legacy_cloud(points)
    cloud.estimate_normals(
        o3d.geometry.KDTreeSearchParamHybrid(config.normal_radius_m, config.normal_neighbours)
    )
    normals = np.asarray(cloud.normals, dtype=np.float32)
    colors, towards_cameras = attributes[:, :3], attributes[:, 3:]
    # Orientation: a camera can only have seen the side that faces it.
    is_away = np.einsum("ij,ij->i", normals, towards_cameras) < 0
    normals[is_away] *= -1
    return GeometryCloud(points=points, colors=colors.clip(0, 1), normals=normals)


def _without_table(cloud: GeometryCloud, config: FusionConfig) -> GeometryCloud:
    is_above = above_table(cloud.points, config.table_prior)
    if not is_above.any():
        raise EmptyCloudError(
            f"All {len(cloud)} points belong to the table; there is nothing on it. Set table to "
            "'keep' to see the table itself."
        )
    return GeometryCloud(
        points=cloud.points[is_above],
        colors=cloud.colors[is_above],
        normals=cloud.normals[is_above],
    )


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
