"""Render every kind of scene, and one arrangement of each suite, into one labelled picture.

python -m tools.scene_sheet --out docs/scenes.png
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from sr_mj.cli import run_command

_CELL_PX = (480, 270)
_CAPTION_PX = 22
_COLUMNS = 3
# Colours are rounded to multiples of this: unseen by the eye, and the file is half as large.
_COLOR_STEP = 5


@dataclass(frozen=True, kw_only=True)
class SheetConfig:
    """Options of `python -m tools.scene_sheet`."""

    out: Path = Path("docs/scenes.png")
    """PNG to write."""
    seed: int = 0
    """Seed of the scenes that are drawn at random."""


def make_sheet(config: SheetConfig) -> int:
    """Render the sheet; returns exit status 0."""
    from sr_mj.gl import select_backend

    select_backend()
    import numpy as np
    from PIL import Image, ImageDraw, ImageFont

    from models.arrangements.library import SUITES, arrangement_names
    from models.cameras import OVERVIEW
    from sr_mj.scene import SCENE_KINDS, scene_config
    from sr_mj.scene.build import make_scene
    from sr_mj.sensors.renderer import CameraRig

    names = [*SCENE_KINDS, *(arrangement_names(s, "unseen")[0] for s in SUITES)]
    width, height = _CELL_PX
    pitch = height + _CAPTION_PX
    sheet = Image.new("RGB", (_COLUMNS * width, -(-len(names) // _COLUMNS) * pitch), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    for index, name in enumerate(names):
        scene = make_scene(scene_config(name, seed=config.seed))
        with CameraRig(scene.model, (OVERVIEW,)) as rig:
            image = Image.fromarray(rig.render(scene.data, OVERVIEW.name)[0])
        left, top = index % _COLUMNS * width, index // _COLUMNS * pitch
        sheet.paste(image.resize(_CELL_PX, Image.Resampling.LANCZOS), (left, top))
        draw.text((left + 4, top + height + 3), f"{name}: {scene.goal.text}", "black", font)
    levels = np.rint(np.asarray(sheet, float) / _COLOR_STEP) * _COLOR_STEP
    Image.fromarray(levels.astype(np.uint8)).save(config.out, optimize=True)
    print(f"{config.out}: {len(names)} scenes, {config.out.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(run_command(SheetConfig, make_sheet, description=__doc__ or ""))
