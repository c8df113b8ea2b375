"""Hollow containers: bowls, mugs, cups, tubs. Their insides are open to other objects."""

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.paint import Color, as_image, grid, lay, mix, noise
from models.objects.surface import circle, revolve, sweep

_GLAZE_PX = (192, 256)


def _glazed(
    rng: np.random.Generator, outside: Color, inside: Color, rim_v: float, rim: Color
) -> np.ndarray:
    """Paint a vessel whose texture climbs outside to the rim at `rim_v`, then down inside."""
    _, v = grid(_GLAZE_PX)
    image = mix(outside, inside, (v > rim_v).astype(float))
    image = image + 5 * noise(rng, _GLAZE_PX, (5, 8), 3)[..., None]
    return lay(image, rim, np.exp(-(((v - rim_v) / 0.012) ** 2)))


def _rim_v(profile: np.ndarray) -> float:
    """Return the texture height of the highest point of a profile, by arc length."""
    steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return float(along[profile[:, 1].argmax()] / along[-1])


def bowl(
    *,
    diameter_m: float,
    height_m: float,
    foot_m: float,
    wall_m: float,
    outside: Color,
    inside: Color,
    rim: Color,
    seed: int,
) -> Shape:
    """Shape a bowl with a flat foot and a curved wall; `foot_m` is the foot's diameter."""
    rng = np.random.default_rng(seed)
    radius, foot = diameter_m / 2, foot_m / 2
    t = np.linspace(0, 1, 10)
    outer_r = foot + (radius - foot) * np.sin(t * np.pi / 2) ** 0.9
    outer_z = height_m * (1 - np.cos(t * np.pi / 2)) ** 0.85
    outer = np.stack([outer_r, outer_z], axis=1)
    floor = wall_m * 1.2
    inner = np.stack([outer_r - wall_m, floor + (height_m - floor) * outer_z / height_m], axis=1)
    lip = [(radius - wall_m / 2, height_m + wall_m * 0.25)]
    profile = np.concatenate([[(0.0, 0.0)], outer, lip, inner[::-1], [(0.0, floor)]])
    profile[:, 1] *= height_m / profile[:, 1].max()
    image = as_image(_glazed(rng, outside, inside, _rim_v(profile), rim))
    levels = [0, 5, 9]
    parts = collision.vessel(outer[levels], inner[levels])
    return Shape(
        solids=[Solid.of(revolve(profile, num_columns=48), image)], collision=parts, gloss=0.6
    )


def mug(
    *,
    diameter_m: float,
    height_m: float,
    wall_m: float,
    handle_m: float,
    outside: Color,
    inside: Color,
    band: Color,
    seed: int,
) -> Shape:
    """Shape a straight mug with a handle towards +x that stands out by `handle_m`."""
    rng = np.random.default_rng(seed)
    radius, floor = diameter_m / 2, 1.2 * wall_m
    climb = np.linspace(0.003, height_m - 0.0015, 6)
    profile = np.array(
        [(0, 0), (radius - 0.003, 0)]
        + [(radius, z) for z in climb]
        + [(radius - wall_m / 2, height_m)]
        + [(radius - wall_m, z) for z in climb[:0:-1]]
        + [(radius - wall_m, floor + 0.003), (radius - wall_m - 0.003, floor), (0, floor)]
    )
    rim_v = _rim_v(profile)
    image = _glazed(rng, outside, inside, rim_v, outside)
    _, v = grid(_GLAZE_PX)
    image = lay(image, band, ((v > 0.80 * rim_v) & (v < 0.88 * rim_v)).astype(float))
    path = _handle_path(radius - wall_m / 2, height_m, handle_m)
    handle = sweep(path, np.array([[0.0065, 0.0042]] * len(path)), num_columns=12, up=(0, 1, 0))
    handle_image = as_image(np.full((8, 8, 3), outside, float))
    parts = _straight_wall(radius, wall_m, 0.0, height_m)
    parts.append(collision.cylinder(radius - wall_m, 0.0, floor))
    parts += collision.capsule_chain(0.005, path[[0, 4, 8, 12, 16]])
    solids = [Solid.of(revolve(profile, num_columns=48), as_image(image))]
    solids.append(Solid.of(handle, handle_image))
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.6)


def _handle_path(start: float, height: float, reach: float) -> np.ndarray:
    """Return the (17, 3) centre line of a handle, an arc from the lower to the upper root."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    x = start + (reach - 0.002) * np.cos(angle) ** 0.7
    return np.stack([x, 0 * x, height * (0.5 + 0.30 * np.sin(angle))], axis=1)


def _straight_wall(
    radius: float, wall: float, low: float, high: float, num_sectors: int = 12
) -> list[collision.CollisionPart]:
    """Return the boxes that make an upright round wall."""
    middle = radius - wall / 2
    width = 2 * radius * np.tan(np.pi / num_sectors)
    board = collision.box((wall, width, high - low), (middle, 0, (low + high) / 2))
    turns = np.arange(num_sectors) * (2 * np.pi / num_sectors)
    return [board.moved(rotation=Rotation.from_euler("z", turn)) for turn in turns]


def cup(
    *,
    top_m: float,
    bottom_m: float,
    height_m: float,
    wall_m: float,
    outside: Color,
    inside: Color,
    stripe: Color,
    squareness: float = 2.0,
    aspect: float = 1.0,
    seed: int,
) -> Shape:
    """Shape a tapered cup, beaker or tub without a handle.

    Args:
        top_m: Outer width of the rim along x.
        bottom_m: Outer width of the foot along x.
        height_m: Height.
        wall_m: Thickness of the wall.
        outside: Colour outside.
        inside: Colour inside.
        stripe: Colour of the bands outside.
        squareness: Exponent of the superelliptic section, 2 for round.
        aspect: Extent along y over extent along x.
        seed: Varies the surface.
    """
    rng = np.random.default_rng(seed)
    top, bottom, floor = top_m / 2, bottom_m / 2, 1.3 * wall_m
    outer = np.array([(bottom, 0.0), (top, height_m)])
    inner_foot = bottom + (top - bottom) * floor / height_m - wall_m
    inner = np.array([(inner_foot, floor), (top - wall_m, height_m)])
    climb = np.linspace(0, 1, 6)[:, None]
    outer_wall = outer[0] + (outer[1] - outer[0]) * climb
    inner_wall = inner[0] + (inner[1] - inner[0]) * climb
    outer_wall[-1, 1] -= 0.25 * wall_m
    inner_wall[-1, 1] -= 0.25 * wall_m
    profile = np.concatenate(
        [[(0, 0)], outer_wall, [(top - wall_m / 2, height_m)], inner_wall[::-1], [(0, floor)]]
    )
    rim_v = _rim_v(profile)
    image = _glazed(rng, outside, inside, rim_v, outside)
    _, v = grid(_GLAZE_PX)
    foot_v = bottom / top_m * rim_v
    level = (v - foot_v) / (rim_v - foot_v)
    for low in (0.70, 0.84):
        image = lay(image, stripe, ((level > low) & (level < low + 0.06)).astype(float))
    outline = circle(48, squareness, aspect)
    sector = circle(12, squareness, aspect) if squareness != 2.0 else None
    parts = collision.vessel(outer, inner, section=sector)
    surface = revolve(profile, section=outline)
    return Shape(
        solids=[Solid.of(surface, as_image(image))],
        collision=parts,
        rolls=squareness == 2.0,
        gloss=0.45,
    )


def vase(
    *,
    belly_m: float,
    mouth_m: float,
    foot_m: float,
    height_m: float,
    wall_m: float,
    glaze: Color,
    foot: Color,
    seed: int,
) -> Shape:
    """Shape a round-bellied vase with a flared mouth.

    Args:
        belly_m: Widest diameter, at 40 % of the height.
        mouth_m: Diameter of the mouth.
        foot_m: Diameter of the foot.
        height_m: Height.
        wall_m: Thickness of the wall.
        glaze: Colour of the glaze, outside and inside.
        foot: Colour of the bare clay at the foot.
        seed: Varies the glaze.
    """
    rng = np.random.default_rng(seed)
    knots = np.array([(0, foot_m), (0.40, belly_m), (0.86, 0.92 * mouth_m), (1.0, mouth_m)])
    level = np.linspace(0, 1, 14)
    radius = PchipInterpolator(knots[:, 0], knots[:, 1] / 2)(level)
    floor = 1.5 * wall_m
    outer = np.stack([radius, height_m * level], axis=1)
    inner = np.stack([radius - wall_m, floor + (height_m - floor) * level], axis=1)
    lip = [(mouth_m / 2 - wall_m / 2, height_m + 0.25 * wall_m)]
    profile = np.concatenate([[(0.0, 0.0)], outer, lip, inner[::-1], [(0.0, floor)]])
    profile[:, 1] *= height_m / profile[:, 1].max()
    image = _glazed(rng, glaze, glaze, _rim_v(profile), glaze)
    u, v = grid(_GLAZE_PX)
    drip = 0.20 + 0.03 * np.sin(2 * np.pi * 5 * u) + 0.02 * np.sin(2 * np.pi * 11 * u)
    image = lay(image, foot, (v < drip * _rim_v(profile)).astype(float))
    bands = np.abs(v / _rim_v(profile) - 0.62) < 0.018
    image = lay(image, foot, bands.astype(float))
    steps = [0, 5, 13]
    parts = collision.vessel(outer[steps], inner[steps], num_sectors=8)
    surface = revolve(profile, num_columns=48)
    solids = [Solid.of(surface, as_image(image))]
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.6)
