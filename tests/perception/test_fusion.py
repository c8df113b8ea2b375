from dataclasses import replace

import numpy as np
import pytest

from perception.depth_filter import filter_depth
from perception.errors import EmptyCloudError, InvalidConfigError, InvalidViewError
from perception.fusion import FusionConfig, fuse, ordered_views
from perception.views import CameraView
from perception.voxels import voxel_means

CONFIG = FusionConfig()
BALL_CENTER, BALL_RADIUS = np.array([0.5, 0.08, 0.04]), 0.04


def _with_noise(views: tuple[CameraView, ...], sigma_m: float) -> list[CameraView]:
    rng = np.random.default_rng(0)
    noisy = []
    for view in views:
        depth_m = view.depth_m + sigma_m * rng.normal(size=view.depth_m.shape)
        noisy.append(replace(view, depth_m=np.where(view.depth_m > 0, depth_m, 0).astype("f4")))
    return noisy


def _ball_points(points: np.ndarray) -> np.ndarray:
    """Mask of the points on the ball, off the table."""
    distance = np.linalg.norm(points - BALL_CENTER, axis=1)
    return (distance < BALL_RADIUS + 0.01) & (points[:, 2] > 0.02)


def test_points_lie_on_the_surfaces(table_views: tuple[CameraView, ...]) -> None:
    cloud = fuse(table_views, CONFIG)
    on_ball = _ball_points(cloud.points)
    assert on_ball.sum() > 300
    radii = np.linalg.norm(cloud.points[on_ball] - BALL_CENTER, axis=1)
    assert np.abs(radii - BALL_RADIUS).max() < 0.002
    assert cloud.points[:, 2].min() > -0.001
    assert (cloud.colors[on_ball] == cloud.colors[on_ball][0]).all()
    np.testing.assert_allclose(cloud.colors[on_ball][0], np.array([200, 30, 30]) / 255, atol=1e-6)


def test_cloud_stays_inside_the_workspace(table_views: tuple[CameraView, ...]) -> None:
    points = fuse(table_views, CONFIG).points
    assert (points >= np.asarray(CONFIG.workspace_min, np.float32)).all()
    assert (points <= np.asarray(CONFIG.workspace_max, np.float32)).all()


def test_normals_point_outwards(table_views: tuple[CameraView, ...]) -> None:
    cloud = fuse(table_views, CONFIG)
    on_ball = _ball_points(cloud.points)
    outwards = cloud.points[on_ball] - BALL_CENTER
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    agreement = np.einsum("ij,ij->i", cloud.normals[on_ball], outwards)
    assert np.quantile(agreement, 0.02) > 0.9
    table = cloud.normals[(np.abs(cloud.points[:, 2]) < 1e-3) & (cloud.points[:, 1] > 0.16)]
    assert len(table) > 1000
    assert table[:, 2].min() > np.cos(np.radians(2.0))


def test_noise_is_averaged(table_views: tuple[CameraView, ...]) -> None:
    points = fuse(_with_noise(table_views, 0.002), CONFIG).points
    table = points[(points[:, 1] > 0.16) & (points[:, 2] < 0.02)]
    assert len(table) > 1000
    assert table[:, 2].std() < 0.0012


def test_stray_points_are_removed(table_views: tuple[CameraView, ...]) -> None:
    top = next(view for view in table_views if view.name == "top")
    depth_m = top.depth_m.copy()
    depth_m[120:123, 120:123] = 0.5  # a patch in mid-air that no other pixel supports
    views = [replace(view, depth_m=depth_m) if view is top else view for view in table_views]
    where = top.unproject(np.array([[121.0, 121.0]]), np.array([0.5]))
    distances = [
        np.linalg.norm(fuse(views, config).points - where, axis=1).min()
        for config in (CONFIG, replace(CONFIG, outlier_neighbours=0, min_observations=1))
    ]
    assert distances[0] > 0.05
    assert distances[1] < 0.005


def test_order_of_views_does_not_matter_and_bytes_repeat(
    table_views: tuple[CameraView, ...],
) -> None:
    noisy = _with_noise(table_views, 0.002)
    first, second = fuse(noisy, CONFIG), fuse(noisy[::-1], CONFIG)
    for name in ("points", "colors", "normals"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_flying_pixels_are_removed_and_edges_stay_sharp() -> None:
    depth_m = np.full((20, 20), 0.5, np.float32)
    depth_m[:, 10:] = 0.8
    depth_m[:, 10] = np.linspace(0.55, 0.75, 20)  # a column between the two surfaces
    filtered = filter_depth(depth_m, tolerance_m=0.01, min_neighbours=4, is_smoothed=True)
    assert (filtered[:, 10] == 0).all()
    # The corners of the image have three neighbours only.
    np.testing.assert_allclose(filtered[1:-1, :10], 0.5, atol=1e-7)
    np.testing.assert_allclose(filtered[1:-1, 11:], 0.8, atol=1e-7)


def test_smoothing_never_mixes_in_missing_pixels() -> None:
    depth_m = np.full((10, 10), 0.5, np.float32)
    depth_m[::3, ::3] = 0.0
    filtered = filter_depth(depth_m, tolerance_m=0.01, min_neighbours=3, is_smoothed=True)
    assert (filtered[::3, ::3] == 0).all()
    np.testing.assert_allclose(filtered[filtered > 0], 0.5, atol=1e-7)


def test_voxel_means_by_hand() -> None:
    points = np.array([[0.001, 0, 0], [-0.001, 0, 0], [0.011, 0, 0]], np.float32)
    attributes = np.array([[1.0], [3.0], [5.0]], np.float32)
    means, values, counts = voxel_means(points, attributes, 0.01)
    np.testing.assert_allclose(means, [[0, 0, 0], [0.011, 0, 0]], atol=1e-9)
    np.testing.assert_array_equal(values, [[2.0], [5.0]])
    np.testing.assert_array_equal(counts, [2, 1])


def test_views_are_ordered_by_name(table_views: tuple[CameraView, ...]) -> None:
    assert [view.name for view in ordered_views(table_views)] == ["left", "right", "top"]


def test_no_views() -> None:
    with pytest.raises(InvalidViewError) as caught:
        fuse([], CONFIG)
    assert str(caught.value) == "No views: expected at least one CameraView."


def test_views_of_one_name(table_views: tuple[CameraView, ...]) -> None:
    with pytest.raises(InvalidViewError) as caught:
        fuse([table_views[0], table_views[0]], CONFIG)
    assert str(caught.value) == "Two views are named 'top'; give every view its own name."


def test_no_depth(table_views: tuple[CameraView, ...]) -> None:
    blind = [replace(view, depth_m=np.zeros_like(view.depth_m)) for view in table_views]
    with pytest.raises(EmptyCloudError) as caught:
        fuse(blind, CONFIG)
    assert str(caught.value) == (
        "No depth at all in 3 views (left, right, top): every pixel of depth_m is 0. Check the "
        "sensor and the unit (metres)."
    )


def test_nothing_in_the_workspace(table_views: tuple[CameraView, ...]) -> None:
    config = FusionConfig(workspace_min=(3.0, 3.0, 3.0), workspace_max=(4.0, 4.0, 4.0))
    with pytest.raises(EmptyCloudError) as caught:
        fuse(table_views[:1], config)
    assert str(caught.value) == (
        "None of 230400 depth pixels lies in the workspace (3.0, 3.0, 3.0) to (4.0, 4.0, 4.0). "
        "Check T_world_cam_cv, the unit of depth_m (metres) and the box."
    )


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"workspace_min": (0.0, 0.0, 0.5)},
            "workspace_min (0.0, 0.0, 0.5) is not below workspace_max (0.724, 0.224, 0.4) on every "
            "axis; swap them or widen the box.",
        ),
        ({"voxel_size_m": 0.0}, "voxel_size_m is 0.0, expected more than 0 m."),
        ({"normal_radius_m": -1.0}, "normal_radius_m is -1.0, expected more than 0 m."),
        ({"method": "poisson"}, "Unknown method 'poisson'. Methods: voxel_means, tsdf."),
        ({"table": "drop"}, "table is 'drop', expected 'keep' or 'remove'."),
        (
            {"tsdf_truncation_voxels": 0.5},
            "tsdf_truncation_voxels is 0.5, expected 1 or more.",
        ),
    ],
)
def test_bad_config(fields: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        FusionConfig(**fields)  # pyright: ignore[reportArgumentType]
    assert str(caught.value) == message
