"""Three small pictures of an episode: what was seen first, what was chosen then, how it ended."""

from pathlib import Path

import numpy as np
from PIL import Image

from sr_mj.attempt import Attempt
from sr_mj.evaluation.results import snapshot_path
from sr_mj.pictures import action_picture
from sr_mj.pipeline import Pipeline
from sr_mj.scene import Scene

_WIDTH_PX = 400
_QUALITY = 80


def save_snapshots(
    scene: Scene, pipeline: Pipeline, attempts: list[Attempt], stem: Path
) -> tuple[Path, ...]:
    """Write the pictures of an episode that has just ended.

    Args:
        scene: The scene as the episode left it.
        pipeline: The stages; its first camera is used.
        attempts: What was done.
        stem: Folder and start of the names; the folder is made if need be.

    Returns:
        The files: `STEM-view.jpg`, `-choice.jpg` (if there was a choice), `-outcome.jpg`.
    """
    pictures: dict[str, np.ndarray] = {}
    # What the oracle hands over is not the policy's doing.
    own = next((a for a in attempts if not a.is_hand_over), attempts[0] if attempts else None)
    if own is not None:
        pictures["view"] = own.views[0].rgb
        if own.percept is not None and own.candidates is not None:
            pictures["choice"] = action_picture(own)
    rgb, _ = pipeline.rig.render(scene.data, pipeline.rig.cameras[0].name)
    pictures["outcome"] = rgb
    stem.parent.mkdir(parents=True, exist_ok=True)
    return tuple(_save(pictures[name], snapshot_path(stem, name)) for name in pictures)


def _save(picture: np.ndarray, path: Path) -> Path:
    height = round(_WIDTH_PX * picture.shape[0] / picture.shape[1])
    image = Image.fromarray(picture).resize((_WIDTH_PX, height), Image.Resampling.LANCZOS)
    image.save(path, quality=_QUALITY)
    return path
