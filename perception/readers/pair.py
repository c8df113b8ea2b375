"""A single RGB-D pair: two files and the intrinsics; the world is the camera's own frame."""

from pathlib import Path

from perception.errors import InvalidFileError, InvalidOptionError
from perception.readers.fields import as_positive, get_field, read_json
from perception.readers.folder import read_intrinsics
from perception.readers.frames import Frame, ReadOptions, find_image
from perception.readers.images import DEPTH_SUFFIXES, RGB_SUFFIXES

CAMERA_FILE = "camera.json"


def matches(folder: Path) -> bool:
    """Tell whether a folder holds one pair: color or rgb, depth, and camera.json.

    Args:
        folder: An existing folder.

    Returns:
        Whether it does.
    """
    return _rgb(folder) is not None and (folder / CAMERA_FILE).is_file()


def list_frames(folder: Path, options: ReadOptions) -> list[Frame]:
    """Read what is known of the pair.

    Args:
        folder: A folder of this layout. `camera.json` has `intrinsics` (fx, fy, cx, cy) and
            `depth_scale`, the stored units in a metre.
        options: Intrinsics and depth scale in place of the file's.

    Returns:
        One frame, named like the folder.

    Raises:
        PerceptionError: If a field or an image is missing or wrong.
    """
    path = folder / CAMERA_FILE
    data = read_json(path)
    rgb, depth = _rgb(folder), find_image(folder, "depth", DEPTH_SUFFIXES)
    if rgb is None or depth is None:
        raise InvalidFileError(
            f"{folder}: expected color.png or rgb.png, and depth.png or depth.npy, beside "
            f"{CAMERA_FILE}."
        )
    where = f"{path}: intrinsics"
    return [
        Frame(
            name=folder.resolve().name,
            rgb=rgb,
            depth=depth,
            units_per_m=options.depth_scale
            or as_positive(str(path), "depth_scale", get_field(str(path), data, "depth_scale")),
            intrinsics=options.intrinsics
            or read_intrinsics(where, get_field(str(path), data, "intrinsics")),
            T_world_cam_cv=None,
            where=where,
        )
    ]


def pair_frame(rgb: Path, depth: Path, options: ReadOptions) -> Frame:
    """Make a frame of two files.

    Args:
        rgb: Colour image.
        depth: Depth image, registered to it.
        options: Intrinsics, which are needed, and the depth scale, needed for PNG depth.

    Returns:
        The frame, named like the colour image.

    Raises:
        InvalidOptionError: If intrinsics or depth scale are not given.
    """
    if options.intrinsics is None:
        raise InvalidOptionError(
            f"{rgb}: a single pair needs the camera's intrinsics: --intrinsics FX FY CX CY."
        )
    if options.depth_scale is None and depth.suffix.lower() != ".npy":
        raise InvalidOptionError(
            f"{depth}: PNG depth needs its scale, the stored units in a metre: --depth-scale 1000 "
            "for millimetres."
        )
    return Frame(
        name=rgb.stem,
        rgb=rgb,
        depth=depth,
        units_per_m=options.depth_scale or 1.0,
        intrinsics=options.intrinsics,
        T_world_cam_cv=None,
        where="intrinsics",
    )


def _rgb(folder: Path) -> Path | None:
    return find_image(folder, "color", RGB_SUFFIXES) or find_image(folder, "rgb", RGB_SUFFIXES)
