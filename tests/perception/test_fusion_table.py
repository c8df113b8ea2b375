from dataclasses import replace

import numpy as np
import pytest

from perception.errors import EmptyCloudError, InvalidConfigError
from perception.fusion import FusionConfig, fuse
from perception.table_plane import Plane, TablePrior, above_table, find_table
from perception.views import CameraView

PRIOR = TablePrior()


def _plane_points(
    normal: np.ndarray, height_m: float, num_points: int = 4000, sigma_m: float = 0.001
) -> np.ndarray:
    """Points of a plane through (0.5, 0, height), over half a metre, with noise in z."""
    rng = np.random.default_rng(0)
    xy = rng.uniform(-0.25, 0.25, (num_points, 2))
    z = height_m - xy @ normal[:2] / normal[2] + rng.normal(0, sigma_m, num_points)
    return np.column_stack([xy[:, 0] + 0.5, xy[:, 1], z]).astype(np.float32)


def _tilted(degrees: float) -> np.ndarray:
    angle = np.radians(degrees)
    return np.array([np.sin(angle), 0.0, np.cos(angle)])


def test_a_tilted_table_off_its_height_is_found() -> None:
    normal = _tilted(1.5)
    plane = find_table(_plane_points(normal, 0.006), PRIOR)
    assert plane is not None
    assert np.degrees(np.arccos(np.dot(plane.normal, normal))) < 0.1
    height = plane.heights(np.array([[0.5, 0.0, 0.006]]))[0]
    assert abs(height) < 2e-4


def test_a_larger_plane_elsewhere_is_not_taken_for_it() -> None:
    box = _plane_points(_tilted(0.0), 0.1, num_points=20_000)
    table = _plane_points(_tilted(0.0), 0.0, num_points=500)
    plane = find_table(np.concatenate([box, table]), PRIOR)
    assert plane is not None and abs(plane.offset_m) < 2e-4
    assert find_table(box, PRIOR) is None


def test_a_slope_is_no_table() -> None:
    points = _plane_points(_tilted(8.0), 0.0)
    assert find_table(points, PRIOR) is None
    assert above_table(points, PRIOR).all()


def test_same_points_same_plane() -> None:
    points = _plane_points(_tilted(0.5), 0.002)
    assert find_table(points, PRIOR) == find_table(points, PRIOR)


def test_heights_by_hand() -> None:
    plane = Plane(normal=(0.0, 0.6, 0.8), offset_m=1.0)
    np.testing.assert_allclose(
        plane.heights(np.array([[7.0, 0.0, 2.0], [0.0, 1.0, 0.0]])), [0.6, -0.4]
    )


def test_fusion_removes_the_table_and_nothing_else(table_views: tuple[CameraView, ...]) -> None:
    everything = fuse(table_views, FusionConfig())
    objects = fuse(table_views, FusionConfig(table="remove"))
    is_high = everything.points[:, 2] > PRIOR.thickness_m + 1e-4
    assert abs(len(objects) - is_high.sum()) < 0.01 * is_high.sum()
    assert objects.points[:, 2].min() > PRIOR.thickness_m - 1e-3
    rows = {row.tobytes() for row in everything.points}
    assert all(row.tobytes() in rows for row in objects.points)


def test_nothing_but_table(table_views: tuple[CameraView, ...]) -> None:
    config = FusionConfig(
        workspace_min=(0.6, 0.1, -0.01), workspace_max=(0.7, 0.2, 0.4), table="remove"
    )
    with pytest.raises(EmptyCloudError) as caught:
        fuse(table_views, config)
    num_points = len(fuse(table_views, replace(config, table="keep")))
    assert str(caught.value) == (
        f"All {num_points} points belong to the table; there is nothing on it. Set table to 'keep' "
        "to see the table itself."
    )


def test_bad_prior() -> None:
    with pytest.raises(InvalidConfigError) as caught:
        TablePrior(thickness_m=0.0)
    assert str(caught.value) == "thickness_m is 0.0, expected more than 0."
