"""Reading RGB-D views from folders: our own layout, a single pair, and those of known data sets."""

import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from perception.errors import (
    MissingFileError,
    UnknownLayoutError,
    did_you_mean,
)

if TYPE_CHECKING:
    from perception.readers.frames import Frame, ReadOptions
    from perception.views import CameraView

# In the order of detection: GraspNet scenes may also hold other files.
_MODULES = {
    "folder": "perception.readers.folder",
    "bop": "perception.readers.bop",
    "graspnet": "perception.readers.graspnet",
    "tum": "perception.readers.tum",
    "open3d": "perception.readers.open3d_trajectory",
    "pair": "perception.readers.pair",
}
LAYOUTS = tuple(_MODULES)
_EXPECTED = {
    "folder": "cameras.json with rgb/ and depth/",
    "bop": "scene_camera.json with rgb/ and depth/",
    "graspnet": "camK.npy, camera_poses.npy, rgb/ and depth/",
    "tum": "rgb.txt, depth.txt and groundtruth.txt",
    "open3d": "a PinholeCameraTrajectory .json with color/ and depth/",
    "pair": "color.png, depth.png and camera.json",
}


def detect_layout(folder: Path) -> str:
    """Tell by its files which layout a folder has.

    Args:
        folder: The folder.

    Returns:
        One of `LAYOUTS`.

    Raises:
        MissingFileError: If there is no such folder.
        UnknownLayoutError: If no layout fits.
    """
    if not folder.is_dir():
        raise MissingFileError(f"{folder}: no such folder; expected a folder of views.")
    for name, module in _MODULES.items():
        if importlib.import_module(module).matches(folder):
            return name
    known = "; ".join(f"{name}: {files}" for name, files in _EXPECTED.items())
    raise UnknownLayoutError(f"{folder}: no known layout of views. Layouts: {known}.")


def list_views(
    folder: Path, layout: str = "auto", options: "ReadOptions | None" = None
) -> "list[Frame]":
    """List the views of a folder without loading images.

    Args:
        folder: The folder.
        layout: One of `LAYOUTS`, or "auto".
        options: What replaces the layout's own values; the defaults if None.

    Returns:
        All frames of the folder.

    Raises:
        PerceptionError: If a file or field is missing or wrong; the message names it.
    """
    from perception.readers.frames import ReadOptions

    folder = Path(folder)
    if layout not in (*LAYOUTS, "auto"):
        raise UnknownLayoutError(
            f"Unknown layout {layout!r}. Layouts: auto, {', '.join(LAYOUTS)}."
            f"{did_you_mean(layout, LAYOUTS)}"
        )
    found = detect_layout(folder) if layout == "auto" else layout
    reader = importlib.import_module(_MODULES[found])
    if not folder.is_dir():
        raise MissingFileError(f"{folder}: no such folder; expected a folder of views.")
    if not reader.matches(folder):
        raise UnknownLayoutError(
            f"{folder}: is not of layout {found!r}; expected {_EXPECTED[found]}."
        )
    return reader.list_frames(folder, options or ReadOptions())


def read_views(
    folder: Path | str, layout: str = "auto", options: "ReadOptions | None" = None
) -> "tuple[CameraView, ...]":
    """Read views from a folder.

    Args:
        folder: The folder.
        layout: One of `LAYOUTS`, or "auto".
        options: Which views, and what replaces the layout's own values; the defaults if None.

    Returns:
        The views.

    Raises:
        PerceptionError: If a file or field is missing or wrong; the message names it.
    """
    from perception.readers.frames import ReadOptions, choose_frames, load_frame

    options = options or ReadOptions()
    frames = choose_frames(Path(folder), list_views(Path(folder), layout, options), options)
    return tuple(load_frame(frame, options) for frame in frames)


def read_pair(rgb: Path | str, depth: Path | str, options: "ReadOptions") -> "CameraView":
    """Read a single RGB-D pair; the world is the camera's own frame.

    Args:
        rgb: Colour image.
        depth: Depth image, registered to it.
        options: Intrinsics and depth scale.

    Returns:
        The view.

    Raises:
        PerceptionError: If a file or an option is missing or wrong; the message names it.
    """
    from perception.readers.frames import load_frame
    from perception.readers.pair import pair_frame

    return load_frame(pair_frame(Path(rgb), Path(depth), options), options)
