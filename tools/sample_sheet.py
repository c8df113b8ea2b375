"""Render freshly drawn variants of the families into one labelled picture.

Usage:
    MUJOCO_GL=egl python -m tools.sample_sheet --output samples.png --seed 0
    MUJOCO_GL=egl python -m tools.sample_sheet --family mug --count 24

Every object is framed to fill its cell; the number after the label is its largest extent in
millimetres, the words below are its colours.
"""

import argparse
import math
from pathlib import Path

import mujoco
import numpy as np
from dm_control import mjcf
from PIL import Image, ImageDraw, ImageFont

from models.objects import families
from models.objects.asset import ObjectAsset
from models.objects.mjcf_builder import COLLISION_GROUP, VISUAL_GROUP, build_object

_CAPTION_PX = 32
_COLUMNS = 8
_FOV_DEG = 22.0
_OVERSAMPLING = 2
# Objects stand so far apart that none is in another one's picture.
_PITCH_M = 1.5


def draw_assets(count: int, seed: int, family: str | None = None) -> list[ObjectAsset]:
    """Draw variants.

    Args:
        count: How many.
        seed: Seed of the generator.
        family: One family only, or None for all.

    Returns:
        The assets, in the order drawn.
    """
    rng = np.random.default_rng(seed)
    return [families.sample(rng, family=family) for _ in range(count)]


def _stage(assets: list[ObjectAsset], edge_px: int) -> mjcf.Physics:
    """Put the objects on one long floor, `_PITCH_M` apart."""
    root = mjcf.RootElement(model="samples")
    root.visual.headlight.set_attributes(
        ambient=(0.42,) * 3, diffuse=(0.45,) * 3, specular=(0.1,) * 3
    )
    getattr(root.visual, "global").set_attributes(
        offwidth=edge_px, offheight=edge_px, fovy=_FOV_DEG
    )
    # Distances of the clipping planes count in extents, which else would be the row's length.
    root.statistic.extent = 1.0
    root.visual.map.znear, root.visual.map.zfar = 0.01, 100.0
    root.worldbody.add(
        "light", directional=True, dir=(-0.3, 0.45, -0.9), diffuse=(0.4,) * 3, castshadow=False
    )
    root.worldbody.add("geom", type="plane", size=(0, 0, 1), rgba=(0.80, 0.79, 0.77, 1))
    for index, asset in enumerate(assets):
        frame = root.attach(build_object(asset, name=f"object_{index}"))
        frame.pos = (index * _PITCH_M, 0, 0)
    return mjcf.Physics.from_mjcf_model(root)


def render_assets(
    assets: list[ObjectAsset], size_px: int, *, collision: bool = False
) -> list[np.ndarray]:
    """Render each object from the same side.

    Args:
        assets: The objects.
        size_px: Width and height of each picture.
        collision: Show the collision parts instead of the textured meshes.

    Returns:
        One (size_px, size_px, 3) uint8 picture an object.
    """
    edge = size_px * _OVERSAMPLING
    physics = _stage(assets, edge)
    model, data = physics.model.ptr, physics.data.ptr
    camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
    camera.azimuth, camera.elevation = 115.0, -32.0
    option.geomgroup[VISUAL_GROUP] = not collision
    option.geomgroup[COLLISION_GROUP] = collision
    pictures = []
    with mujoco.Renderer(model, edge, edge) as renderer:
        for index, asset in enumerate(assets):
            center = (asset.vertices.max(axis=0) + asset.vertices.min(axis=0)) / 2
            radius = np.linalg.norm(asset.vertices - center, axis=1).max()
            camera.lookat[:] = center
            camera.lookat[0] += index * _PITCH_M
            camera.distance = 1.06 * radius / math.sin(math.radians(_FOV_DEG / 2))
            renderer.update_scene(data, camera, option)
            image = Image.fromarray(renderer.render())
            pictures.append(np.asarray(image.resize((size_px, size_px), Image.Resampling.LANCZOS)))
    return pictures


def sample_sheet(
    assets: list[ObjectAsset], cell_px: int, *, collision: bool = False
) -> Image.Image:
    """Arrange the objects with their labels in rows of eight.

    Args:
        assets: The objects.
        cell_px: Width and height of a cell.
        collision: Show the collision parts.

    Returns:
        The picture.
    """
    pitch = cell_px + _CAPTION_PX
    rows = math.ceil(len(assets) / _COLUMNS)
    sheet = Image.new("RGB", (_COLUMNS * cell_px, rows * pitch), (255, 255, 255))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    pictures = render_assets(assets, cell_px, collision=collision)
    for index, (asset, picture) in enumerate(zip(assets, pictures, strict=True)):
        left, top = index % _COLUMNS * cell_px, index // _COLUMNS * pitch
        sheet.paste(Image.fromarray(picture), (left, top))
        extent = round(float(asset.size_m.max()) * 1000)
        caption = f"{asset.words.title}  {extent}\n{', '.join(asset.words.colors)}"
        draw.multiline_text((left + 4, top + cell_px + 2), caption, (0, 0, 0), font, spacing=1)
    return sheet


def main() -> None:
    """Parse the command line, draw, render, save."""
    parser = argparse.ArgumentParser(description="Render freshly drawn variants into one picture.")
    parser.add_argument("--output", type=Path, default=Path("samples.png"))
    parser.add_argument("--count", type=int, default=48, help="number of variants")
    parser.add_argument("--seed", type=int, default=0, help="seed of the draw")
    parser.add_argument("--family", choices=families.FAMILIES, help="one family only")
    parser.add_argument("--cell", type=int, default=170, help="cell size in pixels")
    parser.add_argument("--collision", action="store_true", help="show the collision parts")
    arguments = parser.parse_args()
    assets = draw_assets(arguments.count, arguments.seed, arguments.family)
    sheet = sample_sheet(assets, arguments.cell, collision=arguments.collision)
    sheet.save(arguments.output, optimize=True)
    print(f"{arguments.output}: {len(assets)} variants, {sheet.width}x{sheet.height}")


if __name__ == "__main__":
    main()
