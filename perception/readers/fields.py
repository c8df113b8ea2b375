"""Fields of JSON files: what is missing or wrong is named by file and field."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from perception.errors import InvalidFileError, InvalidViewError, MissingFileError, did_you_mean
from perception.views import Intrinsics

# What calibration tools call the coefficients of a lens.
_DISTORTION_NAMES = (
    "distortion",
    "distortion_coefficients",
    "dist_coeffs",
    "dist",
    "D",
    "k1",
    "k2",
)
_RIGID_TOLERANCE = 1e-3  # files are written with few digits; the rotation is made exact below


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file whose outermost value is an object.

    Args:
        path: The file.

    Returns:
        The object.

    Raises:
        MissingFileError: If there is no such file.
        InvalidFileError: If it is no JSON, or holds something else than an object.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file.")
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InvalidFileError(f"{path}: not valid JSON ({error}).") from error
    if not isinstance(value, dict):
        raise InvalidFileError(f"{path}: holds a {type(value).__name__}; expected an object {{}}.")
    return value


def get_field(where: str, data: Any, name: str) -> Any:
    """Return a field of a JSON object.

    Args:
        where: File, and path of the object within it, for the message.
        data: The object.
        name: Name of the field.

    Returns:
        Its value.

    Raises:
        InvalidFileError: If it is missing.
    """
    if not isinstance(data, dict):
        raise InvalidFileError(f"{where}: is a {type(data).__name__}; expected an object {{}}.")
    if name not in data:
        present = ", ".join(data) or "none"
        hint = did_you_mean(name, data)
        raise InvalidFileError(f"{where}: field {name!r} is missing. Fields: {present}.{hint}")
    return data[name]


def as_numbers(where: str, name: str, value: Any, count: int) -> np.ndarray:
    """Check that a field holds a list of finite numbers, nested or not.

    Args:
        where: File and object.
        name: Name of the field.
        value: Its value.
        count: How many numbers are expected.

    Returns:
        (count,) float64.

    Raises:
        InvalidFileError: If it does not.
    """
    try:
        numbers = np.asarray(value, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        numbers = np.zeros(0)
    if numbers.size != count or not np.isfinite(numbers).all():
        raise InvalidFileError(
            f"{where}: {name} is {shortened(value)}; expected {count} finite numbers."
        )
    return numbers


def as_positive(where: str, name: str, value: Any) -> float:
    """Check that a field holds a positive number.

    Args:
        where: File and object.
        name: Name of the field.
        value: Its value.

    Returns:
        The number.

    Raises:
        InvalidFileError: If it does not.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and math.isfinite(value) and value > 0):
        raise InvalidFileError(f"{where}: {name} is {shortened(value)}; expected a number above 0.")
    return float(value)


def refuse_distortion(where: str, data: Any) -> None:
    """Refuse a camera whose images are not those of a pinhole.

    Args:
        where: File and object.
        data: The object that may hold coefficients of lens distortion.

    Raises:
        InvalidFileError: If one of them is not 0.
    """
    for name in _DISTORTION_NAMES:
        value = data.get(name) if isinstance(data, dict) else None
        try:
            is_zero = value is None or not np.asarray(value, dtype=np.float64).any()
        except (TypeError, ValueError):
            is_zero = False
        if not is_zero:
            raise InvalidFileError(
                f"{where}: {name} is {shortened(value)}; lens distortion is not undone here. "
                "Undistort colour and depth first, give the new intrinsics, and leave the "
                "coefficients out."
            )


def make_intrinsics(
    where: str, values: Sequence[float] | np.ndarray, size: tuple[int, int]
) -> Intrinsics:
    """Make intrinsics from the four numbers of a file and the size of its image.

    Args:
        where: File and object.
        values: fx, fy, cx, cy, pixels.
        size: Height and width of the image.

    Returns:
        The intrinsics.

    Raises:
        InvalidFileError: If a focal length is not positive, or the principal point lies outside
            the image.
    """
    fx, fy, cx, cy = (float(value) for value in values)
    height, width = size
    try:
        intrinsics = Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=width, height=height)
    except InvalidViewError as error:
        raise InvalidFileError(f"{where}: {error}") from error
    if not (0 <= cx < width and 0 <= cy < height):
        raise InvalidFileError(
            f"{where}: the principal point ({cx:g}, {cy:g}) lies outside the image, "
            f"{width}x{height}; the intrinsics belong to another resolution."
        )
    return intrinsics


def as_rigid(where: str, name: str, value: Any) -> np.ndarray:
    """Check that a field holds a rigid transformation.

    Args:
        where: File and object.
        name: Name of the field.
        value: 16 numbers, row by row, nested or not.

    Returns:
        (4, 4) float64 whose rotation is exact.

    Raises:
        InvalidFileError: If it does not.
    """
    matrix = as_numbers(where, name, value, 16).reshape(4, 4)
    rotation = matrix[:3, :3]
    off, det = np.abs(rotation @ rotation.T - np.eye(3)).max(), np.linalg.det(rotation)
    if off > _RIGID_TOLERANCE or det < 0 or not np.allclose(matrix[3], [0, 0, 0, 1], atol=1e-9):
        raise InvalidFileError(
            f"{where}: {name} is not rigid (|R R^T - I| = {off:.2g}, det R = {det:.3g}, last row "
            f"{[float(v) for v in matrix[3]]}); expected a rotation, a translation and the last "
            "row [0, 0, 0, 1]."
        )
    u, _, vt = np.linalg.svd(rotation)
    exact = np.eye(4)
    exact[:3, :3], exact[:3, 3] = u @ vt, matrix[:3, 3]
    return exact


def inverse_rigid(T: np.ndarray) -> np.ndarray:
    """Invert a rigid transformation.

    Args:
        T: (4, 4) rigid transformation.

    Returns:
        (4, 4) float64.
    """
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


def shortened(value: Any, length: int = 60) -> str:
    """Return a value as text that fits into a message.

    Args:
        value: Any value.
        length: Most characters.

    Returns:
        Its representation, cut off where it is longer.
    """
    text = repr(value)
    return text if len(text) <= length else text[: length - 3] + "..."
