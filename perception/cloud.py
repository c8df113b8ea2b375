"""The two clouds that perception hands out: fine geometry, and coarser points with features."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from perception.arrays import checked_array
from perception.errors import InvalidCloudError

_UNIT_TOLERANCE = 1e-3
_ROW_SHAPES: dict[str, tuple[int | str, ...]] = {
    "points": (3,),
    "colors": (3,),
    "normals": (3,),
    "features": ("C",),
    "confidence": (),
    "similarity": (),
}
FEATURE_CLOUD_ARRAYS = tuple(_ROW_SHAPES)


@dataclass(frozen=True, kw_only=True, eq=False)
class GeometryCloud:
    """Surface points of a scene.

    Attributes:
        points: (N, 3) float32 world coordinates, metres.
        colors: (N, 3) float32 RGB, 0..1.
        normals: (N, 3) float32 unit normals, pointing to the side from which cameras saw the point.
    """

    points: np.ndarray
    colors: np.ndarray
    normals: np.ndarray

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        _check_arrays(self, {"points": (3,), "colors": (3,), "normals": (3,)})
        _check_unit(self, "normals")

    def __len__(self) -> int:
        """Return N."""
        return len(self.points)


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureCloud:
    """Points of a scene with the features of the views that saw them.

    Attributes:
        points: (N, 3) float32 world coordinates, metres.
        colors: (N, 3) float32 RGB, 0..1.
        normals: (N, 3) float32 unit normals.
        features: (N, C) float32, unit rows, in the encoder's text space.
        confidence: (N,) float32 in (0, 1], the weight of the views behind the features.
        similarity: (N,) float32, how well the point fits the text that was asked for; see
            `perception.similarity`.
        encoder: Name of the encoder in whose text space the features lie; empty if unknown.
    """

    points: np.ndarray
    colors: np.ndarray
    normals: np.ndarray
    features: np.ndarray
    confidence: np.ndarray
    similarity: np.ndarray
    encoder: str = ""

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        _check_arrays(self, _ROW_SHAPES)
        _check_unit(self, "normals")
        _check_unit(self, "features")

    def __len__(self) -> int:
        """Return N."""
        return len(self.points)

    def take(self, indices: np.ndarray) -> "FeatureCloud":
        """Return some of the points.

        Args:
            indices: (M,) integers, or (N,) booleans.

        Returns:
            A cloud of the chosen points, in the order of `indices`.
        """
        return replace(self, **{name: getattr(self, name)[indices] for name in _ROW_SHAPES})

    def save(self, path: Path | str, *, ply_colors: Literal["similarity", "rgb"] = "rgb") -> None:
        """Write the cloud: everything as .npz, or what viewers show as .ply.

        Args:
            path: File to write, .npz or .ply; one that exists is replaced.
            ply_colors: Colour of the points of a .ply: as seen, or from blue (least similar) to
                red (most similar).

        Raises:
            InvalidFileError: If the suffix is another one, or the file cannot be written.
        """
        from perception.cloud_files import save_cloud

        save_cloud(self, Path(path), ply_colors=ply_colors)

    @classmethod
    def load(cls, path: Path | str) -> "FeatureCloud":
        """Read a cloud that `save` wrote as .npz.

        Args:
            path: The file.

        Returns:
            The same cloud, bit by bit.

        Raises:
            MissingFileError: If there is no such file.
            InvalidFileError: If it holds no cloud.
        """
        from perception.cloud_files import load_cloud

        return load_cloud(Path(path))


def _check_arrays(
    cloud: GeometryCloud | FeatureCloud, row_shapes: dict[str, tuple[int | str, ...]]
) -> None:
    owner = type(cloud).__name__
    num_points = len(cloud.points)
    for name, row_shape in row_shapes.items():
        array = checked_array(
            owner,
            name,
            getattr(cloud, name),
            shape=(num_points, *row_shape),
            dtype=np.float32,
            error=InvalidCloudError,
        )
        object.__setattr__(cloud, name, array)


def _check_unit(cloud: GeometryCloud | FeatureCloud, name: str) -> None:
    norms = np.linalg.norm(getattr(cloud, name), axis=1)
    off = np.abs(norms - 1.0) > _UNIT_TOLERANCE
    if off.any():
        raise InvalidCloudError(
            f"{type(cloud).__name__}: {int(off.sum())} of {len(cloud)} rows of {name} are not of "
            "unit length; normalise them first."
        )
