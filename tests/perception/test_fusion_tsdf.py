from dataclasses import replace

import numpy as np
import pytest

from perception.errors import EmptyCloudError
from perception.fusion import FusionConfig, fuse
from perception.views import CameraView

CONFIG = FusionConfig(method="tsdf")
BALL_CENTER, BALL_RADIUS = np.array([0.5, 0.08, 0.04]), 0.04


def _on_ball(points: np.ndarray) -> np.ndarray:
    distance = np.linalg.norm(points - BALL_CENTER, axis=1)
    return (distance < BALL_RADIUS + 0.01) & (points[:, 2] > 0.02)


def test_surface_colour_and_normals_of_a_ball(table_views: tuple[CameraView, ...]) -> None:
    cloud = fuse(table_views, CONFIG)
    on_ball = _on_ball(cloud.points)
    assert on_ball.sum() > 1000
    outwards = cloud.points[on_ball] - BALL_CENTER
    radii = np.linalg.norm(outwards, axis=1)
    assert np.quantile(np.abs(radii - BALL_RADIUS), 0.95) < 0.0015
    agreement = (cloud.normals[on_ball] * outwards).sum(axis=1) / radii
    assert np.quantile(agreement, 0.02) > 0.9
    # A voxel also averages the colours of rays that pass near it: some table mixes in.
    np.testing.assert_allclose(
        np.median(cloud.colors[on_ball], axis=0), np.array([200, 30, 30]) / 255, atol=0.05
    )


def test_cloud_stays_inside_the_workspace(table_views: tuple[CameraView, ...]) -> None:
    points = fuse(table_views, CONFIG).points
    assert (points >= np.asarray(CONFIG.workspace_min, np.float32)).all()
    assert (points <= np.asarray(CONFIG.workspace_max, np.float32)).all()


def test_bytes_repeat_in_any_order_of_views(table_views: tuple[CameraView, ...]) -> None:
    first, second = fuse(table_views, CONFIG), fuse(table_views[::-1], CONFIG)
    for name in ("points", "colors", "normals"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_noise_is_averaged(table_views: tuple[CameraView, ...]) -> None:
    rng = np.random.default_rng(0)
    noisy = []
    for view in table_views:
        depth_m = view.depth_m + 0.002 * rng.normal(size=view.depth_m.shape)
        noisy.append(replace(view, depth_m=np.where(view.depth_m > 0, depth_m, 0).astype("f4")))
    points = fuse(noisy, CONFIG).points
    table = points[(points[:, 1] > 0.16) & (points[:, 2] < 0.02)]
    assert len(table) > 1000
    assert table[:, 2].std() < 0.0012


def test_nothing_in_the_workspace(table_views: tuple[CameraView, ...]) -> None:
    config = replace(CONFIG, workspace_min=(3.0, 3.0, 3.0), workspace_max=(4.0, 4.0, 4.0))
    with pytest.raises(EmptyCloudError, match="None of 230400 depth pixels lies in the workspace"):
        fuse(table_views[:1], config)
