from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from perception.cloud import FEATURE_CLOUD_ARRAYS, FeatureCloud
from perception.errors import InvalidFileError, MissingFileError
from perception.heatmap import heat_colors


@pytest.fixture
def cloud() -> FeatureCloud:
    rng = np.random.default_rng(0)
    vectors = rng.normal(size=(2, 50, 6)).astype(np.float32)
    features = vectors[0] / np.linalg.norm(vectors[0], axis=1, keepdims=True)
    normals = vectors[1, :, :3] / np.linalg.norm(vectors[1, :, :3], axis=1, keepdims=True)
    return FeatureCloud(
        points=rng.normal(size=(50, 3)).astype(np.float32),
        colors=rng.random((50, 3), np.float32),
        normals=normals,
        features=features,
        confidence=rng.random(50, np.float32),
        similarity=rng.random(50, np.float32),
        encoder="embedded",
    )


def test_npz_gives_every_bit_back(cloud: FeatureCloud, tmp_path: Path) -> None:
    cloud.save(tmp_path / "cloud.npz")
    loaded = FeatureCloud.load(tmp_path / "cloud.npz")
    assert loaded.encoder == "embedded"
    for name in FEATURE_CLOUD_ARRAYS:
        assert getattr(loaded, name).tobytes() == getattr(cloud, name).tobytes()


@pytest.mark.parametrize("name", ["cloud.npz", "cloud.ply"])
def test_same_cloud_same_bytes(cloud: FeatureCloud, tmp_path: Path, name: str) -> None:
    cloud.save(tmp_path / name)
    first = (tmp_path / name).read_bytes()
    cloud.save(str(tmp_path / name))
    assert (tmp_path / name).read_bytes() == first


@pytest.mark.parametrize("suffix", [".npz", ".ply"])
def test_empty_clouds_can_be_saved(cloud: FeatureCloud, tmp_path: Path, suffix: str) -> None:
    empty = cloud.take(np.zeros(0, np.int64))
    if suffix == ".npz":
        empty.save(tmp_path / "empty.npz")
        assert FeatureCloud.load(tmp_path / "empty.npz").features.shape == (0, 6)
    else:
        with pytest.raises(InvalidFileError, match="empty"):
            empty.save(tmp_path / "empty.ply")


def test_ply_shows_similarity_or_colour(cloud: FeatureCloud, tmp_path: Path) -> None:
    for colors in ("similarity", "rgb"):
        cloud.save(tmp_path / "cloud.ply", ply_colors=colors)
        ply = o3d.t.io.read_point_cloud(str(tmp_path / "cloud.ply")).point
        np.testing.assert_array_equal(ply["positions"].numpy(), cloud.points)
        np.testing.assert_array_equal(ply["normals"].numpy(), cloud.normals)
        np.testing.assert_array_equal(ply["similarity"].numpy()[:, 0], cloud.similarity)
        np.testing.assert_array_equal(ply["confidence"].numpy()[:, 0], cloud.confidence)
        shown = ply["colors"].numpy()
        if colors == "rgb":
            assert np.abs(shown / 255 - cloud.colors).max() <= 0.5 / 255 + 1e-6
        else:
            np.testing.assert_array_equal(shown, heat_colors(cloud.similarity))


def test_take_keeps_the_encoder(cloud: FeatureCloud) -> None:
    assert cloud.take(np.array([1, 2])).encoder == "embedded"


def test_heat_runs_from_blue_to_red() -> None:
    colors = heat_colors(np.linspace(0.2, 0.4, 1001, dtype=np.float32)).astype(int)
    assert colors[0, 2] > 1.5 * colors[0, 0] or colors[100, 2] > 2 * colors[100, 0]
    assert colors[-1, 0] > 5 * colors[-1, 2]
    np.testing.assert_array_equal(colors[0], colors[10])  # the lowest 2 % look alike
    assert len(heat_colors(np.zeros(0, np.float32))) == 0
    assert len(np.unique(heat_colors(np.ones(9, np.float32)), axis=0)) == 1


def test_unknown_suffix_and_missing_folder(cloud: FeatureCloud, tmp_path: Path) -> None:
    with pytest.raises(InvalidFileError) as caught:
        cloud.save(tmp_path / "cloud.pcd")
    assert str(caught.value) == (
        f"{tmp_path / 'cloud.pcd'}: a cloud is written as .npz (everything) or .ply (for viewers); "
        "got '.pcd'."
    )
    with pytest.raises(InvalidFileError) as caught:
        cloud.save(tmp_path / "no" / "cloud.npz")
    assert str(caught.value) == (
        f"{tmp_path / 'no' / 'cloud.npz'}: the folder {tmp_path / 'no'} does not exist; make it "
        "first."
    )


def test_files_that_hold_no_cloud(cloud: FeatureCloud, tmp_path: Path) -> None:
    path = tmp_path / "cloud.npz"
    with pytest.raises(MissingFileError) as caught:
        FeatureCloud.load(path)
    assert str(caught.value) == f"{path}: no such file; expected a feature cloud (.npz)."

    cloud.save(tmp_path / "cloud.ply")
    with pytest.raises(InvalidFileError) as caught:
        FeatureCloud.load(tmp_path / "cloud.ply")
    assert str(caught.value) == (
        f"{tmp_path / 'cloud.ply'}: a .ply keeps no features; load the .npz instead."
    )

    np.savez(path, points=cloud.points, colors=cloud.colors)
    with pytest.raises(InvalidFileError) as caught:
        FeatureCloud.load(path)
    assert str(caught.value) == (
        f"{path}: holds no format, normals, features, confidence, similarity; expected what "
        "FeatureCloud.save writes."
    )

    arrays = {name: getattr(cloud, name) for name in FEATURE_CLOUD_ARRAYS}
    np.savez(path, format="sr-mj feature cloud 9", **arrays)
    with pytest.raises(InvalidFileError) as caught:
        FeatureCloud.load(path)
    assert str(caught.value) == (
        f"{path}: format is 'sr-mj feature cloud 9'; expected 'sr-mj feature cloud 1'."
    )

    np.savez(path, format="sr-mj feature cloud 1", **{**arrays, "features": 2 * cloud.features})
    with pytest.raises(InvalidFileError) as caught:
        FeatureCloud.load(path)
    assert str(caught.value) == (
        f"{path}: FeatureCloud: 50 of 50 rows of features are not of unit length; normalise them "
        "first."
    )


@pytest.mark.parametrize("spoil", [lambda b: b"", lambda b: b"text", lambda b: b[: len(b) // 2]])
def test_spoilt_npz(cloud: FeatureCloud, tmp_path: Path, spoil) -> None:
    path = tmp_path / "cloud.npz"
    cloud.save(path)
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(InvalidFileError) as caught:
        FeatureCloud.load(path)
    assert str(caught.value).startswith(f"{path}: not a readable .npz file (")
    assert "\n" not in str(caught.value)
