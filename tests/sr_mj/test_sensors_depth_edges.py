import numpy as np
import pytest

from models.cameras import PinholeSensor
from sr_mj.sensors.depth_edges import find_depth_edges, incidence_cosine

SENSOR = PinholeSensor(width=64, height=48, fx=50.0, fy=40.0, cx=30.0, cy=25.5, range_m=(0.25, 9.0))


def plane(normal: np.ndarray, distance_m: float = 0.7) -> tuple[np.ndarray, np.ndarray]:
    """Depth (H, W) float32 of a plane n . X = n_z * distance, and the true cosine of incidence."""
    u, v = np.meshgrid(np.arange(SENSOR.width), np.arange(SENSOR.height))
    rays = np.stack(
        [(u - SENSOR.cx) / SENSOR.fx, (v - SENSOR.cy) / SENSOR.fy, np.ones(u.shape)], axis=-1
    )
    along = rays @ normal
    cosine = along / np.linalg.norm(normal) / np.linalg.norm(rays, axis=-1)
    return (normal[2] * distance_m / along).astype(np.float32), cosine


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.3, 0, 1), (0, -0.5, 1), (0.4, 0.3, 0.9)])
def test_incidence_is_exact_on_planes(normal):
    depth_m, cosine = plane(np.array(normal, float))
    assert depth_m.min() > 0
    np.testing.assert_allclose(incidence_cosine(depth_m, SENSOR), cosine, atol=2e-4)


def test_incidence_is_not_disturbed_by_an_edge_and_is_undefined_without_return():
    depth_m, cosine = plane(np.array([0.2, 0.1, 1.0]))
    depth_m[:, 32:] *= 2  # parallel, twice as far: the same angles
    depth_m[10:14, 10:14] = 0
    nothing = depth_m == 0
    found = incidence_cosine(depth_m, SENSOR)
    np.testing.assert_array_equal(np.isnan(found), nothing)
    np.testing.assert_allclose(found[~nothing], cosine[~nothing], atol=2e-4)


def test_edges_are_found_on_both_sides_in_rows_and_columns():
    depth_m = np.ones((6, 8), np.float32)
    depth_m[2:4, 3:6] = 2
    pixels, across = find_depth_edges(depth_m, 0.5)
    inside = np.zeros((6, 8), bool)
    inside[2:4, 3:6] = True
    beside = np.zeros((6, 8), bool)
    beside[2:4, [2, 6]] = beside[[1, 4], 3:6] = True
    np.testing.assert_array_equal(pixels, np.flatnonzero(inside | beside))
    assert (inside.flat[pixels] != inside.flat[across]).all()
    rows, columns = np.divmod(np.abs(pixels - across), 8)
    assert set(zip(rows.tolist(), columns.tolist(), strict=True)) <= {(0, 1), (1, 0)}


@pytest.mark.parametrize(("step", "num_edge_pixels"), [(0.0149, 0), (0.0151, 12)])
def test_a_step_counts_from_its_share_of_the_smaller_depth(step, num_edge_pixels):
    depth_m = np.full((6, 8), 2.0, np.float32)
    depth_m[:, 4:] = 2.0 * (1 + step)
    assert find_depth_edges(depth_m, 0.015)[0].size == num_edge_pixels


def test_the_border_of_no_return_is_an_edge():
    depth_m = np.ones((3, 4), np.float32)
    depth_m[:, 2:] = 0
    pixels, across = find_depth_edges(depth_m, 0.015)
    np.testing.assert_array_equal(pixels, [1, 2, 5, 6, 9, 10])
    np.testing.assert_array_equal(across, [2, 1, 6, 5, 10, 9])
