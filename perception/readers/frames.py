"""What every reader makes first: a list of frames, each naming its files; images come later.

A dataset scene has hundreds of frames. Listing them reads small files only; which ones to load is
decided afterwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perception.errors import InvalidFileError, InvalidOptionError, did_you_mean
from perception.readers.fields import make_intrinsics
from perception.readers.images import read_depth, read_rgb
from perception.views import CameraView


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """One RGB-D view that could be loaded.

    Attributes:
        name: Name of the view.
        rgb: Colour image.
        depth: Depth image.
        units_per_m: Stored depth units in a metre.
        intrinsics: fx, fy, cx, cy, pixels.
        T_world_cam_cv: (4, 4) pose of the camera, OpenCV axes; None where the dataset has none.
        where: File and field that the intrinsics and the pose come from, for messages.
    """

    name: str
    rgb: Path
    depth: Path
    units_per_m: float
    intrinsics: tuple[float, float, float, float]
    T_world_cam_cv: np.ndarray | None
    where: str


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """What a caller knows of the files, or wants of them.

    Attributes:
        names: Views to load; all that `max_views` allows if empty.
        max_views: Load at most this many, spread evenly over the list.
        depth_scale: Stored depth units in a metre, in place of what the layout says.
        intrinsics: fx, fy, cx, cy in pixels, in place of what the layout says.
        max_depth_m: Depths beyond count as no return.
    """

    names: tuple[str, ...] = ()
    max_views: int = 12
    depth_scale: float | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    max_depth_m: float | None = None

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.max_views < 1:
            raise InvalidOptionError(f"max_views is {self.max_views}; expected 1 or more.")
        for name in ("depth_scale", "max_depth_m"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InvalidOptionError(f"{name} is {value}; expected a number above 0.")
        if self.intrinsics is not None:
            for name, value in zip(("fx", "fy"), self.intrinsics, strict=False):
                if not (np.isfinite(value) and value > 0):
                    raise InvalidOptionError(
                        f"intrinsics: {name} is {value}; expected more than 0 pixels."
                    )


def choose_frames(folder: Path, frames: Sequence[Frame], options: ReadOptions) -> tuple[Frame, ...]:
    """Choose the frames to load.

    Args:
        folder: Where they come from, for messages.
        frames: All frames.
        options: Names, or how many.

    Returns:
        The chosen frames, in their order.

    Raises:
        InvalidOptionError: If a name does not exist.
        InvalidFileError: If several views are wanted, but have no pose in a common world.
    """
    if options.names:
        by_name = {frame.name: frame for frame in frames}
        for name in options.names:
            if name not in by_name:
                raise InvalidOptionError(
                    f"{folder}: no view {name!r}. Views: {_listed(list(by_name))}."
                    f"{did_you_mean(name, by_name)}"
                )
        chosen = tuple(by_name[name] for name in dict.fromkeys(options.names))
    else:
        count = min(options.max_views, len(frames))
        chosen = tuple(
            frames[i] for i in np.linspace(0, len(frames) - 1, count).round().astype(int)
        )
    for frame in chosen:
        if frame.T_world_cam_cv is None and len(chosen) > 1:
            raise InvalidFileError(
                f"{frame.where}: has no pose of the camera in the world, so {len(chosen)} views "
                f"cannot be fused; choose one view, such as {frame.name!r}."
            )
    return chosen


def load_frame(frame: Frame, options: ReadOptions) -> CameraView:
    """Load the images of a frame.

    Args:
        frame: What to load.
        options: What replaces the layout's own scale and intrinsics.

    Returns:
        The view; in the camera's own frame where the dataset has no pose.

    Raises:
        PerceptionError: If a file is missing or cannot be used; the message names it.
    """
    rgb = read_rgb(frame.rgb)
    depth_m = read_depth(frame.depth, options.depth_scale or frame.units_per_m)
    if depth_m.shape != rgb.shape[:2]:
        raise InvalidFileError(
            f"{frame.depth}: depth is {_size(depth_m)}, but {frame.rgb.name} is {_size(rgb)}; "
            "expected depth registered to the colour image, pixel by pixel."
        )
    where = "intrinsics" if options.intrinsics else frame.where
    intrinsics = make_intrinsics(where, options.intrinsics or frame.intrinsics, rgb.shape[:2])
    if options.max_depth_m is not None:
        depth_m = np.where(depth_m <= options.max_depth_m, depth_m, np.float32(0.0))
    pose = np.eye(4) if frame.T_world_cam_cv is None else frame.T_world_cam_cv
    return CameraView(
        name=frame.name, rgb=rgb, depth_m=depth_m, intrinsics=intrinsics, T_world_cam_cv=pose
    )


def find_image(folder: Path, stem: str, suffixes: Sequence[str]) -> Path | None:
    """Find the image of that stem.

    Args:
        folder: Where to look.
        stem: Name without suffix.
        suffixes: Suffixes to try, in order.

    Returns:
        The file, or None.
    """
    for suffix in suffixes:
        path = folder / f"{stem}{suffix}"
        if path.is_file():
            return path
    return None


def list_images(folder: Path, suffixes: Sequence[str]) -> dict[str, Path]:
    """List the images of a folder.

    Args:
        folder: Where to look; may be missing.
        suffixes: What counts as an image.

    Returns:
        File by stem, in the order of names.
    """
    if not folder.is_dir():
        return {}
    files = sorted(f for f in folder.iterdir() if f.suffix.lower() in suffixes and f.is_file())
    return {file.stem: file for file in files}


def _size(image: np.ndarray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"


def _listed(names: list[str], most: int = 12) -> str:
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown}, ... ({len(names)} in all)"
