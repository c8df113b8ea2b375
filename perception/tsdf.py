"""TSDF integration of RGB-D views with Open3D's `VoxelBlockGrid`, the alternative to voxel means.

Every voxel near a surface averages its signed distance along the rays of all views that see it
(Curless and Levoy 1996); the surface is where the average changes its sign. docs/fusion.md compares
both against true surfaces.
"""

from collections.abc import Sequence

import numpy as np
import open3d as o3d

from perception.views import CameraView

_BLOCK = 16  # voxels along each side of a block
_START_BLOCKS = 4_000  # room for blocks at the start; the grid grows by itself
_DEPTH_SCALE = 1.0  # depth comes in metres
_MIN_WEIGHT = 0.5  # seen by one view


def extract_tsdf(
    views: Sequence[CameraView],
    *,
    voxel_size_m: float,
    truncation_voxels: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Integrate views and take out the surface.

    Args:
        views: At least one view; depth 0 = no return.
        voxel_size_m: Edge of a voxel, metres.
        truncation_voxels: Distance from the surface up to which voxels are kept, in voxels.

    Returns:
        (N, 3) float32 surface points in lexicographic order, and (N, 6) float32: colour (0..1) and
        the outward direction of the distance field.
    """
    grid = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight", "color"),
        attr_dtypes=(o3d.core.float32, o3d.core.float32, o3d.core.float32),
        attr_channels=((1), (1), (3)),  # pyright: ignore[reportArgumentType]
        voxel_size=voxel_size_m,
        block_resolution=_BLOCK,
        block_count=_START_BLOCKS,
    )
    for view in views:
        _integrate(grid, view, float(truncation_voxels))
    surface = grid.extract_point_cloud(weight_threshold=_MIN_WEIGHT)
    if "positions" not in surface.point or len(surface.point.positions) == 0:
        return np.zeros((0, 3), np.float32), np.zeros((0, 6), np.float32)
    points = surface.point.positions.numpy().astype(np.float32)
    colors = surface.point.colors.numpy().astype(np.float32)
    normals = surface.point.normals.numpy().astype(np.float32)
    # The hash map hands out its blocks in an order that changes from run to run.
    order = np.lexsort(points.T[::-1])
    return points[order], np.concatenate([colors, normals], axis=1)[order]


def _integrate(
    grid: "o3d.t.geometry.VoxelBlockGrid", view: CameraView, truncation_voxels: float
) -> None:
    if not view.depth_m.any():
        return
    max_depth_m = float(view.depth_m.max()) + 1.0
    depth = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(view.depth_m.copy()))
    colors = (view.rgb / np.float32(255.0)).astype(np.float32)
    color = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(colors))
    intrinsic = o3d.core.Tensor.from_numpy(view.intrinsics.matrix())
    extrinsic = o3d.core.Tensor.from_numpy(view.T_cam_cv_world.copy())
    blocks = grid.compute_unique_block_coordinates(
        depth, intrinsic, extrinsic, _DEPTH_SCALE, max_depth_m, truncation_voxels
    )
    grid.integrate(
        blocks, depth, color, intrinsic, extrinsic, _DEPTH_SCALE, max_depth_m, truncation_voxels
    )
