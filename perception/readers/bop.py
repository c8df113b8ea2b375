"""A scene of a BOP data set: rgb/, depth/ and scene_camera.json.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md
"""

from pathlib import Path
from typing import Any

import numpy as np

from perception.errors import InvalidFileError
from perception.readers.fields import (
    as_numbers,
    as_positive,
    as_rigid,
    get_field,
    inverse_rigid,
    read_json,
)
from perception.readers.frames import Frame, ReadOptions, list_images
from perception.readers.images import RGB_SUFFIXES

SCENE_FILE = "scene_camera.json"
_MM_PER_M = 1000.0


def matches(folder: Path) -> bool:
    """Tell whether a folder has this layout.

    Args:
        folder: An existing folder.

    Returns:
        Whether it holds `scene_camera.json`.
    """
    return (folder / SCENE_FILE).is_file()


def list_frames(folder: Path, options: ReadOptions) -> list[Frame]:
    """List the frames of a scene.

    Args:
        folder: A folder of this layout, such as `ycbv/test/000048`.
        options: Unused here.

    Returns:
        Frames named by the stems of their images, without a pose where the data set has none.

    Raises:
        PerceptionError: If a field or an image is missing or wrong.
    """
    path = folder / SCENE_FILE
    data = read_json(path)
    rgb = list_images(folder / "rgb", RGB_SUFFIXES) or list_images(folder / "gray", RGB_SUFFIXES)
    depth = list_images(folder / "depth", (".png",))
    names = {int(stem): stem for stem in depth if stem.isdigit() and stem in rgb}
    if not names:
        raise InvalidFileError(
            f"{folder}: rgb/ (or gray/) and depth/ share no numbered image; expected files such as "
            "rgb/000000.png and depth/000000.png."
        )
    return [
        _make_frame(path, stem, _entry(path, data, number), rgb[stem], depth[stem])
        for number, stem in sorted(names.items())
    ]


def _entry(path: Path, data: dict[str, Any], number: int) -> dict[str, Any]:
    entry = data.get(str(number))
    if not isinstance(entry, dict):
        raise InvalidFileError(f"{path}: has no entry {str(number)!r} for an image of that number.")
    return entry


def _make_frame(path: Path, stem: str, entry: dict[str, Any], rgb: Path, depth: Path) -> Frame:
    where = f"{path}: {int(stem)}"
    K = as_numbers(where, "cam_K", get_field(where, entry, "cam_K"), 9)
    # The file's scale turns stored units into millimetres.
    mm_per_unit = as_positive(where, "depth_scale", get_field(where, entry, "depth_scale"))
    return Frame(
        name=stem,
        rgb=rgb,
        depth=depth,
        units_per_m=_MM_PER_M / mm_per_unit,
        intrinsics=(K[0], K[4], K[2], K[5]),
        T_world_cam_cv=_pose(where, entry),
        where=f"{where}.cam_K" if "cam_R_w2c" in entry else f"{where}",
    )


def _pose(where: str, entry: dict[str, Any]) -> np.ndarray | None:
    if "cam_R_w2c" not in entry or "cam_t_w2c" not in entry:
        return None
    T_cam_world = np.eye(4)
    T_cam_world[:3, :3] = as_numbers(where, "cam_R_w2c", entry["cam_R_w2c"], 9).reshape(3, 3)
    T_cam_world[:3, 3] = as_numbers(where, "cam_t_w2c", entry["cam_t_w2c"], 3) / _MM_PER_M
    return inverse_rigid(as_rigid(where, "cam_R_w2c", T_cam_world))
