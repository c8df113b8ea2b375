"""One camera of a GraspNet-1Billion scene: rgb/, depth/, camK.npy and camera_poses.npy.

Layout: https://graspnetapi.readthedocs.io/en/latest/ ("Check Dataset Files"). The world is the
table's frame where cam0_wrt_table.npy is there, and that of the first camera elsewhere. Depth is in
millimetres.
"""

from pathlib import Path

import numpy as np

from perception.errors import InvalidFileError, UnknownLayoutError
from perception.readers.fields import as_numbers, as_rigid
from perception.readers.frames import Frame, ReadOptions, list_images
from perception.readers.images import RGB_SUFFIXES, load_npy

CAMERAS = ("realsense", "kinect")
_UNITS_PER_M = 1000.0


def matches(folder: Path) -> bool:
    """Tell whether a folder is a scene, or one camera of it.

    Args:
        folder: An existing folder.

    Returns:
        Whether it, or a camera's folder in it, holds `camK.npy`.
    """
    return any((folder / part / "camK.npy").is_file() for part in ("", *CAMERAS))


def list_frames(folder: Path, options: ReadOptions) -> list[Frame]:
    """List the frames of one camera.

    Args:
        folder: A camera's folder, such as `scene_0000/realsense`, or a scene that has only one.
        options: Unused here.

    Returns:
        Frames named by the stems of their images.

    Raises:
        PerceptionError: If a file is missing or wrong, or the scene has two cameras.
    """
    folder = _camera_folder(folder)
    K_path, poses_path = folder / "camK.npy", folder / "camera_poses.npy"
    K = as_numbers(str(K_path), "K", load_npy(K_path), 9)
    poses = load_npy(poses_path)
    table_path = folder / "cam0_wrt_table.npy"
    T_table_cam0 = (
        as_rigid(str(table_path), "cam0_wrt_table", load_npy(table_path))
        if table_path.is_file()
        else np.eye(4)
    )
    rgb = list_images(folder / "rgb", RGB_SUFFIXES)
    depth = list_images(folder / "depth", (".png",))
    stems = [stem for stem in rgb if stem in depth and stem.isdigit()]
    if not stems:
        raise InvalidFileError(
            f"{folder}: rgb/ and depth/ share no numbered image; expected files such as "
            "rgb/0000.png and depth/0000.png."
        )
    last = int(stems[-1])
    if poses.ndim != 3 or poses.shape[1:] != (4, 4) or len(poses) <= last:
        raise InvalidFileError(
            f"{poses_path}: the array is {poses.shape}; expected (F, 4, 4) with F above {last}, "
            "the number of the last image."
        )
    return [
        Frame(
            name=stem,
            rgb=rgb[stem],
            depth=depth[stem],
            units_per_m=_UNITS_PER_M,
            intrinsics=(K[0], K[4], K[2], K[5]),
            T_world_cam_cv=T_table_cam0
            @ as_rigid(str(poses_path), f"[{int(stem)}]", poses[int(stem)]),
            where=str(K_path),
        )
        for stem in stems
    ]


def _camera_folder(folder: Path) -> Path:
    if (folder / "camK.npy").is_file():
        return folder
    present = [name for name in CAMERAS if (folder / name / "camK.npy").is_file()]
    if len(present) == 1:
        return folder / present[0]
    found = " and ".join(present) or "none with camK.npy"
    raise UnknownLayoutError(
        f"{folder}: expected the folder of one GraspNet camera; cameras here: {found}. Name one, "
        f"such as {folder / CAMERAS[0]}."
    )
