import numpy as np
import pytest

from perception.errors import InvalidConfigError
from perception.fusion import FusionConfig, fuse
from perception.segments import SegmentConfig, find_segments
from perception.views import CameraView

CONFIG = SegmentConfig()
SPLIT = SegmentConfig(is_split_at_creases=True)


def _ball(center: tuple[float, float, float], radius_m: float = 0.03) -> np.ndarray:
    """(6000, 6) points and outward normals, evenly spread."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(6000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.concatenate([center + radius_m * normals, normals], axis=1).astype(np.float32)


def _labels(rows: np.ndarray, config: SegmentConfig) -> np.ndarray:
    labels = np.full(len(rows), -1)
    for number, segment in enumerate(find_segments(rows[:, :3], rows[:, 3:], config)):
        assert (labels[segment.indices] == -1).all()
        labels[segment.indices] = number
    return labels


def test_things_apart_are_segments() -> None:
    rows = np.concatenate([_ball((0.0, 0.0, 0.0)), _ball((0.1, 0.0, 0.0), 0.02)])
    np.testing.assert_array_equal(_labels(rows, CONFIG), np.repeat([0, 1], 6000))


@pytest.mark.parametrize("distance_m", [0.05, 0.054, 0.058])
def test_things_that_touch_are_parted_at_the_crease(distance_m: float) -> None:
    left, right = _ball((0.0, 0.0, 0.0)), _ball((distance_m, 0.0, 0.0))
    # What lies inside of the other ball is seen by nobody.
    left, right = left[left[:, 0] < distance_m / 2], right[right[:, 0] > distance_m / 2]
    rows = np.concatenate([left, right])
    assert set(_labels(rows, CONFIG)) == {0}
    labels = _labels(rows, SPLIT)
    first, second = labels[: len(left)], labels[len(left) :]
    assert np.median(first) != np.median(second)
    assert (first == np.median(first)).mean() > 0.95
    assert (second == np.median(second)).mean() > 0.95


def test_a_convex_thing_stays_whole() -> None:
    labels = _labels(_ball((0.0, 0.0, 0.0)), SPLIT)
    assert (labels == 0).all()


def test_boxes_bound_and_order_is_by_size() -> None:
    rows = np.concatenate([_ball((0.1, 0.0, 0.0), 0.02), _ball((0.0, 0.0, 0.0))])
    large, small = find_segments(rows[:, :3], rows[:, 3:], CONFIG)
    np.testing.assert_array_equal(large.indices, np.arange(6000, 12000))
    np.testing.assert_allclose(large.high - large.low, 0.06, atol=1e-3)
    np.testing.assert_allclose(small.center, [0.1, 0.0, 0.0], atol=1e-3)


def test_crumbs_are_left_out() -> None:
    rows = np.concatenate([_ball((0.0, 0.0, 0.0)), _ball((0.2, 0.0, 0.0), 0.003)])
    np.testing.assert_array_equal(np.unique(_labels(rows, CONFIG)[6000:]), [-1])


def test_no_points() -> None:
    assert find_segments(np.zeros((0, 3), "f4"), np.zeros((0, 3), "f4"), CONFIG) == ()


def test_order_of_points_does_not_matter() -> None:
    rows = np.concatenate([_ball((0.0, 0.0, 0.0)), _ball((0.1, 0.0, 0.0), 0.02)])
    order = np.random.default_rng(1).permutation(len(rows))
    np.testing.assert_array_equal(_labels(rows[order], CONFIG), _labels(rows, CONFIG)[order])


@pytest.mark.parametrize("config", [CONFIG, SPLIT])
def test_objects_of_a_fused_scene(
    table_views: tuple[CameraView, ...], config: SegmentConfig
) -> None:
    cloud = fuse(table_views, FusionConfig(table="remove"))
    segments = find_segments(cloud.points, cloud.normals, config)
    for center in ((0.5, 0.08), (0.44, -0.09), (0.6, -0.05)):
        near = [s for s in segments[:3] if np.linalg.norm(s.center[:2] - center) < 0.01]
        assert len(near) == 1


def test_bad_config() -> None:
    with pytest.raises(InvalidConfigError) as caught:
        SegmentConfig(radius_m=0.0)
    assert str(caught.value) == "radius_m is 0.0, expected more than 0."
