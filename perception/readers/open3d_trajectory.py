"""Images with an Open3D pinhole camera trajectory (JSON): color/, depth/ and trajectory.json.

The trajectory is what `open3d.io.write_pinhole_camera_trajectory` writes: for each image the
intrinsics, and the extrinsics that map world into camera coordinates (OpenCV axes). Images are
matched by their order. https://www.open3d.org/docs/release/python_api/open3d.camera.PinholeCameraTrajectory.html
"""

from pathlib import Path
from typing import Any

from perception.errors import InvalidFileError, InvalidOptionError
from perception.readers.fields import (
    as_numbers,
    as_rigid,
    get_field,
    inverse_rigid,
    read_json,
    shortened,
)
from perception.readers.frames import Frame, ReadOptions, list_images
from perception.readers.images import DEPTH_SUFFIXES, RGB_SUFFIXES

_CLASS_NAME = "PinholeCameraTrajectory"
_COLOR_FOLDERS = ("color", "rgb", "image", "images")
_UNITS_PER_M = 1000.0  # Open3D's own default


def matches(folder: Path) -> bool:
    """Tell whether a folder has this layout.

    Args:
        folder: An existing folder.

    Returns:
        Whether a JSON file in it says that it is a pinhole camera trajectory.
    """
    return bool(_trajectories(folder))


def list_frames(folder: Path, options: ReadOptions) -> list[Frame]:
    """List the frames of a trajectory.

    Args:
        folder: A folder of this layout.
        options: A depth scale, where depth is not in millimetres.

    Returns:
        Frames named by the stems of their colour images.

    Raises:
        PerceptionError: If a field or an image is missing or wrong, or the numbers of images and
            cameras differ.
    """
    found = _trajectories(folder)
    if len(found) != 1:
        names = ", ".join(path.name for path in found) or "none"
        raise InvalidOptionError(
            f"{folder}: expected one Open3D trajectory beside the images; found {names}."
        )
    path = found[0]
    parameters = get_field(str(path), read_json(path), "parameters")
    if not isinstance(parameters, list):
        raise InvalidFileError(f"{path}: parameters is {shortened(parameters)}; expected a list.")
    color = next((c for n in _COLOR_FOLDERS if (c := list_images(folder / n, RGB_SUFFIXES))), {})
    depth = list_images(folder / "depth", DEPTH_SUFFIXES)
    if not len(color) == len(depth) == len(parameters) or not parameters:
        raise InvalidFileError(
            f"{path}: parameters has {len(parameters)} cameras, but there are {len(color)} colour "
            f"({' or '.join(f'{n}/' for n in _COLOR_FOLDERS)}) and {len(depth)} depth images "
            "(depth/); expected one of each for every camera."
        )
    return [
        _make_frame(f"{path}: parameters[{index}]", camera, color_path, depth_path)
        for index, (camera, color_path, depth_path) in enumerate(
            zip(parameters, color.values(), depth.values(), strict=True)
        )
    ]


def _trajectories(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.glob("*.json")) if _is_trajectory(path)]


def _is_trajectory(path: Path) -> bool:
    # Enough for detection; Open3D writes the class name first, other writers sort their keys.
    return f'"{_CLASS_NAME}"' in path.read_text(encoding="utf-8", errors="replace")


def _make_frame(where: str, camera: Any, color: Path, depth: Path) -> Frame:
    inner = f"{where}.intrinsic"
    intrinsic = get_field(where, camera, "intrinsic")
    # Open3D writes matrices column by column.
    K = as_numbers(inner, "intrinsic_matrix", get_field(inner, intrinsic, "intrinsic_matrix"), 9)
    flat = as_numbers(where, "extrinsic", get_field(where, camera, "extrinsic"), 16)
    T_cam_world = as_rigid(where, "extrinsic", flat.reshape(4, 4).T)
    return Frame(
        name=color.stem,
        rgb=color,
        depth=depth,
        units_per_m=_UNITS_PER_M,
        intrinsics=(K[0], K[4], K[6], K[7]),
        T_world_cam_cv=inverse_rigid(T_cam_world),
        where=inner,
    )
