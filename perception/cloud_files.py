"""Feature clouds as files: .npz keeps everything, .ply shows colour or similarity in any viewer."""

import zipfile
from pathlib import Path
from typing import Literal

import numpy as np
import open3d as o3d

from perception.cloud import FEATURE_CLOUD_ARRAYS, FeatureCloud
from perception.errors import InvalidCloudError, InvalidFileError, MissingFileError
from perception.heatmap import heat_colors

_FORMAT = "sr-mj feature cloud 1"


def save_cloud(
    cloud: FeatureCloud, path: Path, *, ply_colors: Literal["similarity", "rgb"] = "rgb"
) -> None:
    """Write a cloud; the same cloud gives the same bytes.

    Args:
        cloud: The cloud.
        path: File to write, .npz or .ply; its folder must exist.
        ply_colors: What the colours of a .ply show.

    Raises:
        InvalidFileError: If the suffix is another one, or the file cannot be written.
    """
    if path.suffix not in (".npz", ".ply"):
        raise InvalidFileError(
            f"{path}: a cloud is written as .npz (everything) or .ply (for viewers); got "
            f"{path.suffix!r}."
        )
    if not path.parent.is_dir():
        raise InvalidFileError(f"{path}: the folder {path.parent} does not exist; make it first.")
    if path.suffix == ".ply":
        _save_ply(cloud, path, ply_colors)
        return
    arrays = {name: getattr(cloud, name) for name in FEATURE_CLOUD_ARRAYS}
    np.savez(path, format=_FORMAT, encoder=cloud.encoder, **arrays)


def load_cloud(path: Path) -> FeatureCloud:
    """Read a cloud that `save_cloud` wrote as .npz.

    Args:
        path: The file.

    Returns:
        The cloud.

    Raises:
        MissingFileError: If there is no such file.
        InvalidFileError: If it holds no feature cloud.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file; expected a feature cloud (.npz).")
    if path.suffix == ".ply":
        raise InvalidFileError(f"{path}: a .ply keeps no features; load the .npz instead.")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, AttributeError) as error:
        raise InvalidFileError(
            f"{path}: not a readable .npz file ({str(error).splitlines()[0]})."
        ) from error
    missing = [name for name in ("format", *FEATURE_CLOUD_ARRAYS) if name not in arrays]
    if missing:
        raise InvalidFileError(
            f"{path}: holds no {', '.join(missing)}; expected what FeatureCloud.save writes."
        )
    if str(arrays["format"]) != _FORMAT:
        raise InvalidFileError(
            f"{path}: format is {str(arrays['format'])!r}; expected {_FORMAT!r}."
        )
    try:
        return FeatureCloud(
            **{name: arrays[name] for name in FEATURE_CLOUD_ARRAYS},
            encoder=str(arrays.get("encoder", "")),
        )
    except InvalidCloudError as error:
        raise InvalidFileError(f"{path}: {error}") from error


def _save_ply(cloud: FeatureCloud, path: Path, colors: Literal["similarity", "rgb"]) -> None:
    shown = (
        heat_colors(cloud.similarity)
        if colors == "similarity"
        else np.rint(cloud.colors * 255).astype(np.uint8)
    )
    attributes = {
        "positions": cloud.points,
        "normals": cloud.normals,
        "colors": shown,
        "similarity": cloud.similarity[:, None],
        "confidence": cloud.confidence[:, None],
    }
    ply = o3d.t.geometry.PointCloud()
    for name, array in attributes.items():
        ply.point[name] = o3d.core.Tensor.from_numpy(np.array(array))
    if not o3d.t.io.write_point_cloud(path, ply):
        raise InvalidFileError(f"{path}: Open3D could not write the point cloud.")
