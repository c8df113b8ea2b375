"""Render every object of the catalogue into one labelled picture.

Usage:
    MUJOCO_GL=egl python -m tools.contact_sheet --output docs/objects.png

Objects are drawn at one scale a cell, framed to fill it; the number after the name is the largest
extent in millimetres.
"""

import argparse
import math
from pathlib import Path

import mujoco
import numpy as np
from dm_control import mjcf
from PIL import Image, ImageDraw, ImageFont

from models.objects.catalogue import SPLITS, load_object, object_names
from models.objects.mjcf_builder import COLLISION_GROUP, VISUAL_GROUP, build_object

_CAPTION_PX = 18
_HEADING_PX = 30
_COLUMNS = 10
_OVERSAMPLING = 2
# Colours are rounded to multiples of this: unseen by the eye, and the file is half as large.
_COLOR_STEP = 5
_FOV_DEG = 22.0


def render_object(
    name: str,
    size_px: int,
    *,
    azimuth_deg: float = 115.0,
    elevation_deg: float = -32.0,
    collision: bool = False,
) -> np.ndarray:
    """Render one object alone on a plain floor.

    Args:
        name: Name in the catalogue.
        size_px: Width and height of the picture.
        azimuth_deg: Direction in which the camera looks, about z.
        elevation_deg: Negative looks down.
        collision: Show the collision parts instead of the textured mesh.

    Returns:
        (size_px, size_px, 3) uint8.
    """
    asset = load_object(name)
    root = mjcf.RootElement(model="sheet")
    root.visual.headlight.ambient = (0.42, 0.42, 0.42)
    root.visual.headlight.diffuse = (0.30, 0.30, 0.30)
    root.visual.headlight.specular = (0.1, 0.1, 0.1)
    getattr(root.visual, "global").set_attributes(
        offwidth=size_px * _OVERSAMPLING, offheight=size_px * _OVERSAMPLING, fovy=_FOV_DEG
    )
    root.visual.map.znear = 0.01
    root.worldbody.add(
        "light", pos=(0.5, -0.7, 1.4), dir=(-0.3, 0.45, -0.9), diffuse=(0.5,) * 3, castshadow=True
    )
    root.worldbody.add("geom", type="plane", size=(3, 3, 0.1), rgba=(0.80, 0.79, 0.77, 1))
    root.attach(build_object(asset))
    physics = mjcf.Physics.from_mjcf_model(root)
    model, data = physics.model.ptr, physics.data.ptr

    camera = mujoco.MjvCamera()
    center = (asset.vertices.max(axis=0) + asset.vertices.min(axis=0)) / 2
    radius = np.linalg.norm(asset.vertices - center, axis=1).max()
    camera.lookat[:] = center
    camera.distance = 1.06 * radius / math.sin(math.radians(_FOV_DEG / 2))
    camera.azimuth, camera.elevation = azimuth_deg, elevation_deg
    option = mujoco.MjvOption()
    option.geomgroup[VISUAL_GROUP] = not collision
    option.geomgroup[COLLISION_GROUP] = collision
    edge = size_px * _OVERSAMPLING
    with mujoco.Renderer(model, edge, edge) as renderer:
        renderer.update_scene(data, camera, option)
        image = renderer.render()
    return np.asarray(Image.fromarray(image).resize((size_px, size_px), Image.Resampling.LANCZOS))


def contact_sheet(cell_px: int, *, collision: bool = False) -> Image.Image:
    """Render both splits into one picture.

    Args:
        cell_px: Width and height of a cell.
        collision: Show collision parts instead of textured meshes.

    Returns:
        The picture.
    """
    rows = {split: math.ceil(len(object_names(split)) / _COLUMNS) for split in SPLITS}
    pitch = cell_px + _CAPTION_PX
    height = sum(_HEADING_PX + count * pitch for count in rows.values())
    sheet = Image.new("RGB", (_COLUMNS * cell_px, height), (255, 255, 255))
    draw = ImageDraw.Draw(sheet)
    top = 0
    for split in SPLITS:
        names = object_names(split)
        draw.text((6, top + 5), f"{split} ({len(names)})", (0, 0, 0), ImageFont.load_default(18))
        top += _HEADING_PX
        for index, name in enumerate(names):
            left, upper = index % _COLUMNS * cell_px, top + index // _COLUMNS * pitch
            picture = render_object(name, cell_px, collision=collision)
            sheet.paste(Image.fromarray(picture), (left, upper))
            extent = round(float(load_object(name).size_m.max()) * 1000)
            caption = f"{name}  {extent}"
            draw.text(
                (left + 4, upper + cell_px + 2), caption, (0, 0, 0), ImageFont.load_default(11)
            )
        top += rows[split] * pitch
    return sheet


def main() -> None:
    """Parse the command line, render, save."""
    parser = argparse.ArgumentParser(
        description="Render every object of the catalogue into one picture."
    )
    parser.add_argument("--output", type=Path, default=Path("docs/objects.png"))
    parser.add_argument("--cell", type=int, default=150, help="cell size in pixels")
    parser.add_argument("--collision", action="store_true", help="show the collision parts")
    arguments = parser.parse_args()
    sheet = contact_sheet(arguments.cell, collision=arguments.collision)
    levels = np.rint(np.asarray(sheet, float) / _COLOR_STEP) * _COLOR_STEP
    Image.fromarray(levels.astype(np.uint8)).save(arguments.output, optimize=True)
    print(
        f"{arguments.output}: {sheet.width}x{sheet.height}, {arguments.output.stat().st_size} bytes"
    )


if __name__ == "__main__":
    main()
