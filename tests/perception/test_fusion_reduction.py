from dataclasses import replace

import numpy as np
import pytest

from perception import voxels
from perception.cloud import FeatureCloud
from perception.errors import InvalidConfigError
from perception.voxels import reduce_cloud, voxel_rows


def _cloud(num_points: int) -> FeatureCloud:
    rng = np.random.default_rng(0)
    normals, features = rng.normal(size=(num_points, 3)), rng.normal(size=(num_points, 8))
    return FeatureCloud(
        points=rng.uniform(0, 0.05, (num_points, 3)).astype("f4"),
        colors=rng.uniform(0, 1, (num_points, 3)).astype("f4"),
        normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype("f4"),
        features=(features / np.linalg.norm(features, axis=1, keepdims=True)).astype("f4"),
        confidence=rng.uniform(0.1, 1, num_points).astype("f4"),
        similarity=rng.uniform(0, 1, num_points).astype("f4"),
        encoder="test",
    )


def test_features_are_averaged_by_confidence() -> None:
    cloud = FeatureCloud(
        points=np.array([[0, 0, 0], [0.002, 0, 0], [0.1, 0, 0]], "f4"),
        colors=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "f4"),
        normals=np.tile(np.array([0, 0, 1], "f4"), (3, 1)),
        features=np.array([[1, 0], [0, 1], [0, 1]], "f4"),
        confidence=np.array([0.9, 0.3, 0.5], "f4"),
        similarity=np.array([0.2, 0.6, 0.4], "f4"),
    )
    reduced = reduce_cloud(cloud, 0.01)
    np.testing.assert_allclose(reduced.points, [[0.0005, 0, 0], [0.1, 0, 0]], atol=1e-8)
    np.testing.assert_allclose(reduced.colors, [[0.25, 0, 0], [0, 1, 0]], atol=1e-7)
    np.testing.assert_allclose(
        reduced.features, [[3 / np.sqrt(10), 1 / np.sqrt(10)], [0, 1]], atol=1e-7
    )
    np.testing.assert_allclose(reduced.similarity, [0.3, 0.4], atol=1e-7)
    np.testing.assert_array_equal(reduced.confidence, np.array([0.9, 0.5], np.float32))


def test_opposite_directions_leave_the_surest() -> None:
    cloud = _cloud(2)
    axis = np.array([[0, 0, 1], [0, 0, -1]], "f4")
    same = replace(cloud, normals=axis, confidence=np.array([0.5, 0.5], "f4"))
    np.testing.assert_array_equal(reduce_cloud(same, 1.0).normals, axis[:1])


def test_tiny_voxels_change_nothing_but_the_order() -> None:
    cloud = _cloud(300)
    reduced = reduce_cloud(cloud, 1e-5)
    order = np.lexsort(cloud.points.T[::-1])
    found = np.lexsort(reduced.points.T[::-1])
    for name in ("points", "colors", "normals", "features", "confidence", "similarity"):
        np.testing.assert_allclose(
            getattr(reduced, name)[found], getattr(cloud, name)[order], atol=1e-6
        )
    assert reduced.encoder == "test"


def test_order_of_points_does_not_matter() -> None:
    cloud = _cloud(500)
    shuffled = cloud.take(np.random.default_rng(1).permutation(500))
    first, second = reduce_cloud(cloud, 0.01), reduce_cloud(shuffled, 0.01)
    assert 50 < len(first) < 300
    np.testing.assert_allclose(first.features, second.features, atol=1e-6)
    np.testing.assert_array_equal(first.confidence, second.confidence)


def test_empty_cloud() -> None:
    empty = _cloud(3).take(np.zeros(3, bool))
    assert len(reduce_cloud(empty, 0.01)) == 0


def test_table_and_sorting_number_voxels_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    points = _cloud(2000).points
    tabled = voxel_rows(points, 0.004)
    monkeypatch.setattr(voxels, "_MOST_TABLED_CELLS", 0)
    for one, other in zip(tabled, voxel_rows(points, 0.004), strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype == np.int64


def test_bad_size() -> None:
    with pytest.raises(InvalidConfigError) as caught:
        reduce_cloud(_cloud(3), 0.0)
    assert str(caught.value) == "voxel_size_m is 0.0, expected more than 0 m."
