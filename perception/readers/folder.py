"""The package's own layout: rgb/, depth/ and cameras.json; reading and writing.

    VIEWS/rgb/front.png    VIEWS/depth/front.png    VIEWS/cameras.json

    {"convention": "cv",
     "depth_scale": 1000,
     "cameras": {
       "front": {"intrinsics": {"fx": 914.0, "fy": 914.0, "cx": 640.0, "cy": 360.0},
                 "T_world_cam": [[1, 0, 0, 0.5], [0, -1, 0, 0], [0, 0, -1, 0.7], [0, 0, 0, 1]]}}}

`convention` names the camera's axes: "cv" (x right, y down, z forward: OpenCV, ROS optical) or "gl"
(x right, y up, z backward: OpenGL, Blender, MuJoCo). `T_world_cam` maps camera coordinates into the
world; `T_cam_world`, its inverse, may stand in its place. `intrinsics`, `depth_scale` and
`convention` may stand at the top for all cameras or in one camera. `depth_scale` counts stored
units in a metre; only .npy depth may leave it out: it is in metres then.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from perception.errors import InvalidFileError
from perception.readers.fields import (
    as_positive,
    as_rigid,
    get_field,
    inverse_rigid,
    read_json,
    refuse_distortion,
    shortened,
)
from perception.readers.frames import Frame, ReadOptions, list_images
from perception.readers.images import DEPTH_SUFFIXES, RGB_SUFFIXES
from perception.views import CameraView

CAMERAS_FILE = "cameras.json"
_INTRINSIC_NAMES = ("fx", "fy", "cx", "cy")
_MM_PER_M = 1000
# Maps OpenCV camera coordinates into OpenGL ones, and back.
_T_GL_CV = np.diag([1.0, -1.0, -1.0, 1.0])
_T_AXES_CV = {"cv": np.eye(4), "gl": _T_GL_CV}


def matches(folder: Path) -> bool:
    """Tell whether a folder has this layout.

    Args:
        folder: An existing folder.

    Returns:
        Whether it holds `cameras.json`.
    """
    return (folder / CAMERAS_FILE).is_file()


def list_frames(folder: Path, options: ReadOptions) -> list[Frame]:
    """List the views of a folder.

    Args:
        folder: A folder of this layout.
        options: Intrinsics and depth scale that need not stand in the file then.

    Returns:
        One frame for each camera, in the order of `cameras.json`.

    Raises:
        PerceptionError: If a field or an image is missing or wrong, or images and cameras do not
            belong together.
    """
    path = folder / CAMERAS_FILE
    data = read_json(path)
    cameras = get_field(str(path), data, "cameras")
    if not isinstance(cameras, dict) or not cameras:
        raise InvalidFileError(
            f"{path}: cameras is {shortened(cameras)}; expected an object with one entry for each "
            "view."
        )
    rgb = list_images(folder / "rgb", RGB_SUFFIXES)
    depth = list_images(folder / "depth", DEPTH_SUFFIXES)
    _check_same_views(path, "rgb", rgb, cameras)
    _check_same_views(path, "depth", depth, cameras)
    return [
        _make_frame(path, name, {**data, **_as_object(path, name, camera)}, rgb, depth, options)
        for name, camera in cameras.items()
    ]


def save_views(views: Sequence[CameraView], folder: Path | str) -> None:
    """Write views in this layout: PNG colour, 16-bit PNG depth in millimetres, OpenCV axes.

    Args:
        views: The views, under different names.
        folder: Where to write; made where it does not exist.

    Raises:
        InvalidFileError: If a depth does not fit into 16 bits of millimetres.
    """
    folder = Path(folder)
    for part in ("rgb", "depth"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    cameras = {}
    for view in views:
        millimetres = np.rint(view.depth_m * np.float32(_MM_PER_M))
        if millimetres.max() > np.iinfo(np.uint16).max:
            raise InvalidFileError(
                f"View {view.name!r}: depth reaches {view.depth_m.max():.1f} m; a 16-bit PNG in "
                "millimetres holds up to 65.5 m. Set what lies beyond to 0."
            )
        Image.fromarray(view.rgb).save(folder / "rgb" / f"{view.name}.png")
        depth = Image.fromarray(millimetres.astype(np.uint16))
        depth.save(folder / "depth" / f"{view.name}.png")
        K = view.intrinsics
        cameras[view.name] = {
            "intrinsics": {"fx": K.fx, "fy": K.fy, "cx": K.cx, "cy": K.cy},
            "T_world_cam": view.T_world_cam_cv.tolist(),
        }
    data = {"convention": "cv", "depth_scale": _MM_PER_M, "cameras": cameras}
    (folder / CAMERAS_FILE).write_text(json.dumps(data, indent=1) + "\n")


def read_intrinsics(where: str, data: Any) -> tuple[float, float, float, float]:
    """Read fx, fy, cx and cy from a JSON object.

    Args:
        where: File and object, for messages.
        data: The object.

    Returns:
        The four numbers, pixels.

    Raises:
        InvalidFileError: If one is missing or not a positive number, or lens distortion is given.
    """
    refuse_distortion(where, data)
    fx, fy, cx, cy = (
        as_positive(where, name, get_field(where, data, name)) for name in _INTRINSIC_NAMES
    )
    return fx, fy, cx, cy


def _make_frame(
    path: Path,
    name: str,
    camera: dict[str, Any],
    rgb: dict[str, Path],
    depth: dict[str, Path],
    options: ReadOptions,
) -> Frame:
    where = f"{path}: cameras.{name}"
    refuse_distortion(where, camera)
    intrinsics = options.intrinsics or read_intrinsics(
        f"{where}.intrinsics", get_field(where, camera, "intrinsics")
    )
    return Frame(
        name=name,
        rgb=rgb[name],
        depth=depth[name],
        units_per_m=options.depth_scale or _depth_scale(where, camera, depth[name]),
        intrinsics=intrinsics,
        T_world_cam_cv=_read_pose(where, camera),
        where=where,
    )


def _as_object(path: Path, name: str, camera: Any) -> dict[str, Any]:
    if not isinstance(camera, dict):
        raise InvalidFileError(
            f"{path}: cameras.{name} is {shortened(camera)}; expected an object with intrinsics "
            "and T_world_cam."
        )
    return camera


def _depth_scale(where: str, camera: dict[str, Any], depth: Path) -> float:
    if "depth_scale" not in camera and depth.suffix.lower() == ".npy":
        return 1.0
    return as_positive(where, "depth_scale", get_field(where, camera, "depth_scale"))


def _read_pose(where: str, camera: dict[str, Any]) -> np.ndarray:
    convention = get_field(where, camera, "convention")
    if not isinstance(convention, str) or convention not in _T_AXES_CV:
        raise InvalidFileError(
            f"{where}: convention is {shortened(convention)}; expected 'cv' (x right, y down, z "
            "forward) or 'gl' (x right, y up, z backward)."
        )
    if ("T_world_cam" in camera) == ("T_cam_world" in camera):
        given = "both" if "T_world_cam" in camera else "neither"
        raise InvalidFileError(
            f"{where}: {given} of T_world_cam and T_cam_world given; expected one: T_world_cam "
            "maps camera coordinates into the world, T_cam_world is its inverse."
        )
    if "T_world_cam" in camera:
        T_world_cam = as_rigid(where, "T_world_cam", camera["T_world_cam"])
    else:
        T_world_cam = inverse_rigid(as_rigid(where, "T_cam_world", camera["T_cam_world"]))
    return T_world_cam @ _T_AXES_CV[convention]


def _check_same_views(
    path: Path, part: str, images: dict[str, Path], cameras: dict[str, Any]
) -> None:
    missing = [name for name in cameras if name not in images]
    extra = [name for name in images if name not in cameras]
    if missing:
        raise InvalidFileError(
            f"{path}: cameras lists {', '.join(missing)}, but {part}/ has no such image; images: "
            f"{', '.join(images) or 'none'}."
        )
    if extra:
        raise InvalidFileError(
            f"{path}: {part}/ holds {', '.join(extra)}, but cameras has no such entry; entries: "
            f"{', '.join(cameras)}."
        )
