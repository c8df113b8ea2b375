"""Make the README's picture from a run of the main command.

    python -m tools.run_picture --seed 0 --out docs/run.png
    python -m tools.run_picture --scene place8 --goal "give me the apple, put it near the bowl"

Top: a frame of the video, and the cloud with the grasps or places of the last attempt; below: where
the cloud fits what was looked for, in the three views.
"""

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from PIL import Image

_WIDTH_PX = 1328
_TOP_PX, _FRAME_PX = 480, 624
# Colours are rounded to multiples of this: unseen by the eye, and the file is half as large.
_COLOR_STEP = 5


@dataclass(frozen=True, kw_only=True)
class PictureConfig:
    """Options of `python -m tools.run_picture`."""

    scene: str = "cluttered15"
    """Kind of scene, or arrangement."""
    goal: str | None = None
    """Instruction; drawn by default."""
    policy: str = "sr"
    """How grasp or place is chosen."""
    seed: int = 0
    """Seed of the run."""
    moment: float = 0.75
    """Share of the video after which the frame is taken."""
    out: Path = Path("docs/run.png")
    """PNG to write."""


def _cover(image: Image.Image, width: int, height: int) -> Image.Image:
    """Scale and crop about the middle to exactly this size."""
    scale = max(width / image.width, height / image.height)
    size = (round(image.width * scale), round(image.height * scale))
    image = image.resize(size, Image.Resampling.LANCZOS)
    left, top = (image.width - width) // 2, (image.height - height) // 2
    return image.crop((left, top, left + width, top + height))


def compose(folder: Path, video: Path, moment: float) -> Image.Image:
    """Compose the picture from a run's output folder and its video."""
    import imageio.v3 as imageio

    frames = imageio.imread(video)
    frame = Image.fromarray(frames[int(moment * (len(frames) - 1))])
    # In the order of their names, what was placed comes after what was picked.
    action = Image.open(sorted([*folder.glob("*_grasp.png"), *folder.glob("*_place.png")])[-1])
    overlay = Image.open(sorted(folder.glob("*_similarity.png"))[-1])
    overlay = overlay.resize((_WIDTH_PX, round(overlay.height * _WIDTH_PX / overlay.width)))
    picture = Image.new("RGB", (_WIDTH_PX, _TOP_PX + overlay.height))
    picture.paste(_cover(frame, _FRAME_PX, _TOP_PX), (0, 0))
    picture.paste(_cover(action, _WIDTH_PX - _FRAME_PX, _TOP_PX), (_FRAME_PX, 0))
    picture.paste(overlay, (0, _TOP_PX))
    return picture


def main(config: PictureConfig) -> None:
    """Run an episode, print its account, save the picture."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, video = Path(scratch) / "run", Path(scratch) / "run.mp4"
        arguments = ["--scene", config.scene, "--policy", config.policy]
        arguments += ["--seed", str(config.seed), "--out", str(folder), "--record", str(video)]
        arguments += [] if config.goal is None else ["--goal", config.goal]
        subprocess.run([sys.executable, "-m", "sr_mj.run", *arguments], check=True)
        picture = compose(folder, video, config.moment)
    levels = np.rint(np.asarray(picture, float) / _COLOR_STEP) * _COLOR_STEP
    Image.fromarray(levels.astype(np.uint8)).save(config.out, optimize=True)


if __name__ == "__main__":
    main(tyro.cli(PictureConfig, description=__doc__))
