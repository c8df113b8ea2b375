"""A sequence of the TUM RGB-D benchmark: rgb.txt, depth.txt and groundtruth.txt.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats. Colour, depth and pose have
time stamps of their own; a frame takes the depth and the pose nearest in time to its colour image.
"""

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from perception.errors import InvalidFileError, MissingFileError
from perception.readers.frames import Frame, ReadOptions

_MAX_TIME_DIFFERENCE_S = 0.02  # as the benchmark's own associate.py
_UNITS_PER_M = 5000.0
# https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats, "Intrinsic Camera Calibration";
# lens distortion is left alone.
_INTRINSICS = {
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
}
_DEFAULT_INTRINSICS = (525.0, 525.0, 319.5, 239.5)


def matches(folder: Path) -> bool:
    """Tell whether a folder has this layout.

    Args:
        folder: An existing folder.

    Returns:
        Whether it holds `rgb.txt` and `depth.txt`.
    """
    return (folder / "rgb.txt").is_file() and (folder / "depth.txt").is_file()


def list_frames(folder: Path, options: ReadOptions) -> list[Frame]:
    """List the frames of a sequence.

    Args:
        folder: A folder of this layout; its name chooses the intrinsics of freiburg1, 2 or 3,
            elsewhere the default of the sensor's driver is taken.
        options: Unused here.

    Returns:
        Frames named by the stems of their colour images; those without depth or pose at their time
        are left out.

    Raises:
        PerceptionError: If a file is missing or wrong, or no frame is left.
    """
    rgb_times, rgb_rows = _read_table(folder / "rgb.txt", 1)
    depth_times, depth_rows = _read_table(folder / "depth.txt", 1)
    truth_path = folder / "groundtruth.txt"
    pose_times, pose_rows = _read_table(truth_path, 7)
    poses = _poses(truth_path, pose_rows)
    depth_of = _nearest(rgb_times, depth_times)
    pose_of = _nearest(rgb_times, pose_times)
    frames = [
        Frame(
            name=Path(row[0]).stem,
            rgb=_image_path(folder, "rgb.txt", row[0]),
            depth=_image_path(folder, "depth.txt", depth_rows[d][0]),
            units_per_m=_UNITS_PER_M,
            intrinsics=_intrinsics(folder),
            T_world_cam_cv=poses[p],
            where=str(truth_path),
        )
        for row, d, p in zip(rgb_rows, depth_of, pose_of, strict=True)
        if d >= 0 and p >= 0
    ]
    if not frames:
        raise InvalidFileError(
            f"{folder}: no colour image has depth and pose within {_MAX_TIME_DIFFERENCE_S} s; "
            "check the time stamps of rgb.txt, depth.txt and groundtruth.txt."
        )
    return frames


def _read_table(path: Path, num_columns: int) -> tuple[np.ndarray, list[list[str]]]:
    """Return (N,) time stamps and the other columns of each line."""
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file.")
    times, rows = [], []
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        stamp, *row = line.replace(",", " ").split()
        if len(row) != num_columns or not _is_number(stamp):
            raise InvalidFileError(
                f"{path}: line {number} is {line.strip()!r}; expected a time stamp and "
                f"{num_columns} column{'s' if num_columns > 1 else ''}."
            )
        times.append(float(stamp))
        rows.append(row)
    if not times:
        raise InvalidFileError(f"{path}: has no line with a time stamp.")
    order = np.argsort(times, kind="stable")
    return np.asarray(times)[order], [rows[i] for i in order]


def _is_number(text: str) -> bool:
    return re.fullmatch(r"-?\d+(\.\d*)?(e[+-]?\d+)?", text, re.IGNORECASE) is not None


def _poses(path: Path, rows: list[list[str]]) -> np.ndarray:
    """Return (N, 4, 4) poses of tx ty tz qx qy qz qw."""
    try:
        values = np.array(rows, dtype=np.float64)
        rotations = Rotation.from_quat(values[:, 3:])
    except ValueError as error:
        raise InvalidFileError(
            f"{path}: a pose cannot be read ({error}); expected tx ty tz qx qy qz qw."
        ) from error
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations.as_matrix(), values[:, :3]
    return poses


def _nearest(times: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the index of the nearest other time, -1 where it is too far."""
    right = np.searchsorted(others, times).clip(1, max(len(others) - 1, 1))
    right = np.minimum(right, len(others) - 1)
    left = np.maximum(right - 1, 0)
    index = np.where(np.abs(others[left] - times) <= np.abs(others[right] - times), left, right)
    return np.where(np.abs(others[index] - times) <= _MAX_TIME_DIFFERENCE_S, index, -1)


def _image_path(folder: Path, table: str, name: str) -> Path:
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InvalidFileError(
            f"{folder / table}: {name!r} lies outside the sequence; expected a relative path "
            "within it."
        )
    return path


def _intrinsics(folder: Path) -> tuple[float, float, float, float]:
    for name, values in _INTRINSICS.items():
        if name in folder.resolve().name:
            return values
    return _DEFAULT_INTRINSICS
