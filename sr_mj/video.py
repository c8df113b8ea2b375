"""Records an episode from the spectator's camera, in simulated time."""

from pathlib import Path
from types import TracebackType
from typing import Self

import imageio.v2 as imageio

from models.cameras import OVERVIEW
from sr_mj.errors import ConfigError
from sr_mj.scene import Scene
from sr_mj.sensors.renderer import CameraRig

FORMATS = (".mp4", ".gif")


def check_video_path(path: Path) -> None:
    """Refuse a file name that no video could be written to.

    Args:
        path: Where the video is to go.

    Raises:
        ConfigError: If the format is unknown or the folder does not exist.
    """
    if path.suffix.lower() not in FORMATS:
        raise ConfigError(
            f"Cannot record to {str(path)!r}: the name ends in {path.suffix!r}, expected one of "
            f"{', '.join(FORMATS)}."
        )
    if not path.absolute().parent.is_dir():
        raise ConfigError(f"Cannot record to {str(path)!r}: create its folder first.")


class VideoRecorder:
    """Writes a frame for every so many simulation steps; the file appears when it is complete.

    Args:
        scene: The scene to film.
        path: Where the video goes; `.mp4` or `.gif`.
        fps: Frames per second of video.
        speed: Simulated seconds per second of video.
    """

    def __init__(self, scene: Scene, path: Path, *, fps: int = 25, speed: float = 2.0) -> None:
        """Open renderer and encoder."""
        check_video_path(path)
        self._path = path
        self._partial = path.with_name(f".{path.stem}.partial{path.suffix}")
        self._rig = CameraRig(scene.model, (OVERVIEW,))
        self._writer = imageio.get_writer(self._partial, fps=fps)
        self._steps_per_frame = max(round(speed / fps / scene.model.opt.timestep), 1)
        self._step = 0

    def __call__(self, scene: Scene) -> None:
        """Take a frame if one is due; to be called after every simulation step."""
        if self._step % self._steps_per_frame == 0:
            self._writer.append_data(self._rig.render(scene.data, OVERVIEW.name)[0])
        self._step += 1

    def __enter__(self) -> Self:
        """Return the recorder itself."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Finish the file, or remove it if something went wrong or nothing was filmed."""
        self._writer.close()
        self._rig.close()
        if exc_type is None and self._step:
            self._partial.replace(self._path)
        else:
            self._partial.unlink(missing_ok=True)
