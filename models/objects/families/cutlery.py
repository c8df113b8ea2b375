"""Kitchen tools that lie flat: spoon, fork, turner."""

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.paint import Color, Poster, brushed_metal, plain, shade, wood
from models.objects.surface import circle, ellipsoid, plate, sweep


def wooden_spoon(
    *, length_m: float, bowl_m: tuple[float, float], handle_m: float, wood_color: Color, seed: int
) -> Shape:
    """Shape a cooking spoon: round handle, oval bowl with a hollow on top.

    Args:
        length_m: Length.
        bowl_m: Length and width of the bowl.
        handle_m: Diameter of the handle.
        wood_color: Colour of the wood.
        seed: Varies the grain.
    """
    rng = np.random.default_rng(seed)
    grain = np.rot90(wood(rng, wood_color, shade(wood_color, 0.82), (96, 160))).copy()
    half = np.array([bowl_m[0] / 2, bowl_m[1] / 2, 0.0075])
    bowl = ellipsoid(half, num_rings=25, num_columns=40).mapped(_hollow(half)).planar_uv()
    bowl = bowl.moved((length_m - half[0], 0, half[2]))
    radius = handle_m / 2
    x = np.linspace(0, length_m - 1.5 * half[0], 12)
    swell = np.interp(x, [0, 0.02, length_m], [0.75, 1.0, 0.85]) * radius
    path = np.stack([x, 0 * x, 0 * x + radius], axis=1)
    handle = sweep(path, np.stack([swell, swell], 1), num_columns=18)
    parts = [
        collision.capsule(0.97 * radius, (radius, 0, radius), path[-1]),
        collision.box((1.6 * half[0], 1.5 * half[1], 0.011), (length_m - half[0], 0, 0.0055)),
        collision.box((1.96 * half[0], half[1], 0.010), (length_m - half[0], 0, 0.0065)),
    ]
    solids = [Solid.of(bowl, grain), Solid.of(handle, grain)]
    return Shape(solids=solids, collision=parts, gloss=0.15)


def _hollow(half: np.ndarray):
    """Return the map that presses a hollow into the upper side of an ellipsoid."""

    def press(points: np.ndarray) -> np.ndarray:
        reach = np.hypot(points[:, 0] / half[0], points[:, 1] / half[1])
        depth = 1.45 * np.clip(1 - (reach / 0.86) ** 2, 0, 1) * half[2]
        up = np.where(points[:, 2] > 0, points[:, 2] - depth, points[:, 2])
        # The flat rim lies at the height of the equator, the bottom below it stays closed.
        return np.column_stack([points[:, :2], np.maximum(up, 0.78 * points[:, 2] - depth * 0.5)])

    return press


def fork(*, length_m: float, width_m: float, grip: Color, seed: int) -> Shape:
    """Shape a table fork with a thick plastic handle, lying on its back, tines towards +x."""
    rng = np.random.default_rng(seed)
    metal = brushed_metal(rng, (190, 194, 200))
    handle_x = np.linspace(0, 0.50 * length_m, 8)
    level = 0.0055
    path = np.stack([handle_x, 0 * handle_x, 0 * handle_x + level], axis=1)
    wide = np.interp(handle_x / length_m, [0, 0.04, 0.3, 0.5], [0.007, 0.0095, 0.008, 0.006])
    sizes = np.stack([wide, np.full(8, level)], axis=1)
    solids = [Solid.of(sweep(path, sizes, section=circle(24, 3.0)), plain(grip))]
    neck_x = np.array([0.48, 0.60, 0.68, 0.72, 0.76]) * length_m
    neck_z = level + np.array([0, 0.001, 0.0005, -0.001, -0.002])
    neck = np.stack([neck_x, 0 * neck_x, neck_z], axis=1)
    spread = np.array([0.0028, 0.0028, 0.006, 0.42 * width_m, 0.48 * width_m])
    sheet = np.stack([spread, np.full(5, 0.0014)], axis=1)
    solids.append(Solid.of(sweep(neck, sheet, section=circle(24, 4.0)), metal))
    t = np.linspace(0, 1, 8)
    for lane in (-0.39, -0.13, 0.13, 0.39):
        x = length_m * (0.75 + 0.25 * t)
        z = level - 0.002 - 0.0016 * np.sin(np.pi * t) + 0.006 * t**2
        tine = np.stack([x, 0 * x + lane * width_m, z], axis=1)
        thin = np.interp(t, [0, 0.8, 1], [0.0016, 0.0014, 0.0006])
        solids.append(Solid.of(sweep(tine, np.stack([thin, thin], 1), num_columns=10), metal))
    parts = [
        collision.box((0.50 * length_m, 0.017, 2 * level), (0.25 * length_m, 0, level)),
        collision.box((0.28 * length_m, 0.007, 0.003), (0.62 * length_m, 0, level)),
        collision.box((0.26 * length_m, 0.95 * width_m, 0.005), (0.87 * length_m, 0, 0.0032)),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.7)


def turner(
    *, length_m: float, blade_m: tuple[float, float], grip: Color, blade: Color, seed: int
) -> Shape:
    """Shape a kitchen turner lying flat: oval handle, slotted blade.

    Args:
        length_m: Length.
        blade_m: Length and width of the blade.
        grip: Colour of the handle.
        blade: Colour of the blade.
        seed: Varies the brushed stem.
    """
    metal = brushed_metal(np.random.default_rng(seed))
    radius = 0.0105
    start = length_m - blade_m[0]
    x = np.linspace(0, 0.62 * start, 8)
    path = np.stack([x, 0 * x, 0 * x + radius], axis=1)
    wide = radius * np.array([0.7, 1.05, 1.15, 1.1, 1.0, 0.95, 0.95, 0.8])
    thick = radius * np.array([0.7, 0.95, 1.0, 1.0, 0.95, 0.9, 0.9, 0.75])
    handle = sweep(path, np.stack([wide, thick], 1), num_columns=24)
    stem = np.array([(0.60 * start, 0, radius), (0.9 * start, 0, 0.007), (start + 0.012, 0, 0.003)])
    rod = sweep(stem, np.array([[0.004, 0.003]] * 3), num_columns=14)
    outline = circle(72, 6.0, blade_m[1] / blade_m[0]) * (blade_m[0] / 2)
    outline[:, 1] *= 0.86 + 0.14 * outline[:, 0] / (blade_m[0] / 2)
    sheet = plate(outline, 0.005, bevel_m=0.0012).moved((start + blade_m[0] / 2, 0, 0))
    poster = Poster(blade, (112, 144))
    for slot in range(4):
        top = 0.20 + 0.17 * slot
        poster.rectangle((0.22, top, 0.80, top + 0.07), shade(blade, 0.45), radius=0.02)
    collar = Poster(grip, (32, 24)).rectangle((0, 0.0, 1, 0.10), shade(grip, 0.6)).image()
    parts = [
        collision.capsule(radius, (radius, 0, radius), (0.60 * start, 0, radius)),
        collision.capsule(0.0035, stem[0], stem[-1] + [0, 0, 0.0005]),
        collision.box((blade_m[0], 0.92 * blade_m[1], 0.005), (start + blade_m[0] / 2, 0, 0.0025)),
    ]
    solids = [Solid.of(handle, collar), Solid.of(rod, metal), Solid.of(sheet, poster.image())]
    return Shape(solids=solids, collision=parts, gloss=0.4)
