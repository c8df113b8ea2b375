"""Reading of colour and depth images, with one clear line for what is wrong with a file."""

import zipfile
from pathlib import Path

import numpy as np
from PIL import Image

from perception.errors import InvalidFileError, MissingFileError

RGB_SUFFIXES = (".png", ".jpg", ".jpeg")
DEPTH_SUFFIXES = (".png", ".npy")

# No depth camera measures nearer than this, none of those meant here farther.
NEAREST_PLAUSIBLE_M = 0.02
FARTHEST_PLAUSIBLE_M = 100.0


def read_rgb(path: Path) -> np.ndarray:
    """Read a colour image.

    Args:
        path: A PNG or JPEG file; grey and transparent ones become RGB.

    Returns:
        (H, W, 3) uint8.

    Raises:
        MissingFileError: If there is no such file.
        InvalidFileError: If it is no image, or cut off.
    """
    image = _open_image(path)
    if image.mode.startswith(("I", "F")):
        raise InvalidFileError(
            f"{path}: the colour image has mode {image.mode} (more than 8 bits a channel); "
            "expected 8-bit RGB or grey. Is it a depth image?"
        )
    return np.array(image.convert("RGB"))


def read_depth(path: Path, units_per_m: float) -> np.ndarray:
    """Read a depth image.

    Args:
        path: A 16-bit PNG, or a NumPy file (.npy) of integers or floats, (H, W) or (H, W, 1).
        units_per_m: Stored units in a metre: 1000 for millimetres, 1 for metres.

    Returns:
        (H, W) float32, metres; 0 = no return.

    Raises:
        MissingFileError: If there is no such file.
        InvalidFileError: If it is no depth image, cut off, all zero, not finite, negative, or
            obviously not in the declared unit.
    """
    raw = _read_raw_depth(path)
    if not np.isfinite(raw).all():
        bad = int(raw.size - np.isfinite(raw).sum())
        raise InvalidFileError(
            f"{path}: {bad} of {raw.size} depths are NaN or infinite; write 0 where the sensor saw "
            "nothing."
        )
    depth_m = (raw / units_per_m).astype(np.float32)
    if depth_m.min() < 0:
        raise InvalidFileError(
            f"{path}: depth goes down to {raw.min():g}; expected 0 (no return) or more."
        )
    valid = depth_m[depth_m > 0]
    if valid.size == 0:
        raise InvalidFileError(
            f"{path}: all {raw.size} depths are 0 (no return); check the sensor, or leave the view "
            "out."
        )
    _check_unit(path, float(np.median(valid)), units_per_m)
    return depth_m


def _open_image(path: Path) -> Image.Image:
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file; expected an image.")
    try:
        image = Image.open(path)
        image.load()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        reason = str(error).splitlines()[0].replace(str(path), path.name)
        raise InvalidFileError(
            f"{path}: the image cannot be decoded ({reason}); it is cut off or no image. Write it "
            "again."
        ) from error
    return image


def _read_raw_depth(path: Path) -> np.ndarray:
    """Return (H, W) float64 in the stored unit."""
    if path.suffix.lower() == ".npy":
        raw = load_npy(path)
        if raw.ndim == 3 and raw.shape[2] == 1:
            raw = raw[..., 0]
        if raw.ndim != 2 or raw.dtype.kind not in "uif" or raw.size == 0:
            raise InvalidFileError(
                f"{path}: the array is {raw.dtype} {raw.shape}; expected numbers (H, W)."
            )
        return raw.astype(np.float64)
    image = _open_image(path)
    if image.mode not in ("I;16", "I;16B", "I;16L", "I"):
        raise InvalidFileError(
            f"{path}: the depth image has mode {image.mode}; expected a 16-bit PNG with one "
            "channel, or a .npy file."
        )
    return np.asarray(image).astype(np.float64)


def load_npy(path: Path) -> np.ndarray:
    """Load one array from a NumPy file, never code.

    Args:
        path: A .npy file.

    Returns:
        The array.

    Raises:
        MissingFileError: If there is no such file.
        InvalidFileError: If it holds no plain array, or is cut off.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file; expected a NumPy array.")
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise InvalidFileError(
            f"{path}: no NumPy array can be read ({str(error).splitlines()[0]}); write it with "
            "numpy.save."
        ) from error
    if not isinstance(array, np.ndarray):
        raise InvalidFileError(f"{path}: holds an archive; expected a single array (.npy).")
    return array


def _check_unit(path: Path, median_m: float, units_per_m: float) -> None:
    if NEAREST_PLAUSIBLE_M <= median_m <= FARTHEST_PLAUSIBLE_M:
        return
    stored = median_m * units_per_m
    other, unit = (1.0, "metres") if units_per_m > 1.0 else (1000.0, "millimetres")
    is_likely = NEAREST_PLAUSIBLE_M <= stored / other <= FARTHEST_PLAUSIBLE_M
    raise InvalidFileError(
        f"{path}: at a depth scale of {units_per_m:g} units a metre the median depth is "
        f"{median_m:.3g} m; "
        + (
            f"the file seems to be in {unit} (scale {other:g})."
            if is_likely
            else "check the scale."
        )
    )
