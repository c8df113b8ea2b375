"""A configuration that fits given views: the box they see, and voxels that suit their pixels."""

from collections.abc import Sequence

import numpy as np

from perception.errors import EmptyCloudError, InvalidConfigError
from perception.fusion import FusionConfig
from perception.lifter import LifterConfig
from perception.lifting import LiftingConfig
from perception.views import CameraView

Box = tuple[float, float, float, float, float, float]

_PIXELS_PER_VIEW = 20_000
_MARGIN_M = 0.01
_MIN_VOXEL_M = 0.002
# At one pixel a voxel, half of the voxels of a surface hold none or one; at two most hold several.
_PIXELS_PER_VOXEL = 2.0
_FEATURE_VOXELS = 4.0


def fit_config(
    views: Sequence[CameraView],
    *,
    workspace: Box | None = None,
    voxel_size_m: float | None = None,
) -> LifterConfig:
    """Make a configuration for views whose world is not that of the robot's table.

    Without a workspace it is the bounding box of all depth; nothing is known of a table then, and
    all points are lifted. Voxels are two pixels wide at the median depth, at least 2 mm; what else
    has a length grows with them.

    Args:
        views: At least one view.
        workspace: Lower and upper corner, x, y, z each, world, metres.
        voxel_size_m: Edge of the voxels of the geometry cloud.

    Returns:
        The configuration.

    Raises:
        EmptyCloudError: If no view has depth.
        InvalidConfigError: If the workspace is turned over, or the voxel size is not positive.
    """
    points, pixel_size_m = _sample(views)
    if voxel_size_m is None:
        voxel_size_m = max(_MIN_VOXEL_M, round(_PIXELS_PER_VOXEL * pixel_size_m, 4))
    if not voxel_size_m > 0:
        raise InvalidConfigError(f"voxel_size_m is {voxel_size_m}, expected more than 0 m.")
    if workspace is None:
        low, high = points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M
        workspace = (*map(float, low), *map(float, high))  # pyright: ignore[reportAssignmentType]
    growth = max(1.0, voxel_size_m / _MIN_VOXEL_M)
    default = FusionConfig()
    return LifterConfig(
        fusion=FusionConfig(
            workspace_min=workspace[:3],  # pyright: ignore[reportArgumentType, reportOptionalSubscript]
            workspace_max=workspace[3:],  # pyright: ignore[reportArgumentType, reportOptionalSubscript]
            voxel_size_m=voxel_size_m,
            flying_pixel_tolerance_m=default.flying_pixel_tolerance_m * growth,
            normal_radius_m=default.normal_radius_m * growth,
        ),
        lifting=LiftingConfig(mu_m=LiftingConfig().mu_m * growth),
        feature_voxel_size_m=_FEATURE_VOXELS * voxel_size_m,
        is_table_lifted=True,
        num_cached_images=max(LifterConfig().num_cached_images, len(views)),
    )


def _sample(views: Sequence[CameraView]) -> tuple[np.ndarray, float]:
    """Return (N, 3) world points and the median size of a pixel on the surface, metres."""
    points, pixel_sizes = [np.zeros((0, 3))], [np.zeros(0)]
    for view in views:
        v, u = np.nonzero(view.depth_m)
        step = max(1, len(v) // _PIXELS_PER_VIEW)
        v, u = v[::step], u[::step]
        depth_m = view.depth_m[v, u].astype(np.float64)
        points.append(view.unproject(np.stack([u, v], axis=1).astype(np.float64), depth_m))
        pixel_sizes.append(depth_m / max(view.intrinsics.fx, view.intrinsics.fy))
    sizes = np.concatenate(pixel_sizes)
    if sizes.size == 0:
        raise EmptyCloudError(
            f"No depth at all in {len(views)} views; check the sensor and the unit (metres)."
        )
    return np.concatenate(points), float(np.median(sizes))
