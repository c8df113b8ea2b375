"""Toys that are no animals: balls, wooden blocks, an aeroplane."""

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Panel, Solid
from models.objects.paint import (
    WHITE,
    Color,
    Poster,
    as_image,
    grid,
    lay,
    noise,
    plain,
    shade,
    wood,
)
from models.objects.surface import (
    Surface,
    circle,
    ellipsoid,
    plate,
    revolve,
    rounded_box,
    skin,
    sweep,
)

_GLASS: Color = (70, 120, 190)


def ball(*, diameter_m: float, color: Color, seam: Color, words: str, seed: int) -> Shape:
    """Shape a rubber ball with a moulding seam and printed words."""
    rng = np.random.default_rng(seed)
    radius = diameter_m / 2
    latitude = np.linspace(-np.pi / 2, np.pi / 2, 25)
    profile = radius * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    profile[[0, -1], 0] = 0.0
    poster = Poster(color, (192, 384))
    for left in (0.0, 0.5):
        poster.words(words, (left + 0.14, 0.38, left + 0.36, 0.62), WHITE)
    _, v = grid((192, 384))
    image = lay(poster.image(), seam, np.exp(-(((v - 0.72) / 0.008) ** 2)))
    image = image + 6 * noise(rng, (192, 384), (6, 10), 3)[..., None]
    tilt = Rotation.from_euler("x", 20, degrees=True)
    surface = revolve(profile).moved(rotation=tilt)
    return Shape(
        solids=[Solid.of(surface, as_image(image))],
        collision=[collision.sphere(radius)],
        rolls=True,
        gloss=0.3,
    )


def _painted_wood(color: Color, seed: int, shape: tuple[int, int] = (96, 96)) -> np.ndarray:
    """Paint wood whose grain shows through a stain."""
    return wood(np.random.default_rng(seed), color, shade(color, 0.84), shape)


def block(*, size_m: tuple[float, float, float], color: Color, letter: str, seed: int) -> Shape:
    """Shape a wooden building block with a printed letter on each side."""
    grain = _painted_wood(color, seed)
    poster = Poster(WHITE, grain.shape[:2])
    poster.words(letter, (0.24, 0.16, 0.76, 0.84), (0, 0, 0))
    ink = 1 - poster.image().mean(axis=2) / poster.image().max()
    printed = as_image(lay(grain.astype(float), (250, 246, 232), ink))
    panels = tuple(
        Panel(surface=s.moved((0, 0, size_m[2] / 2)), image=printed)
        for s in rounded_box(size_m, 0.0025)
    )
    parts = [collision.box(size_m, (0, 0, size_m[2] / 2))]
    return Shape(solids=[Solid(panels=panels)], collision=parts, gloss=0.2)


def block_cylinder(*, diameter_m: float, height_m: float, color: Color, seed: int) -> Shape:
    """Shape a wooden column standing upright."""
    radius, edge = diameter_m / 2, 0.002
    wall = [(radius, z) for z in np.linspace(edge, height_m - edge, 7)]
    profile = [(0, 0), (radius - edge, 0), *wall, (radius - edge, height_m), (0, height_m)]
    surface = revolve(profile, num_columns=64)
    parts = [collision.cylinder(radius, 0.0, height_m)]
    solid = Solid.of(surface, _painted_wood(color, seed, (128, 128)))
    return Shape(solids=[solid], collision=parts, rolls=True, gloss=0.2)


def block_arch(*, size_m: tuple[float, float, float], color: Color, seed: int) -> Shape:
    """Shape a wooden bridge block: a half-round opening below, along y."""
    width, depth, height = size_m
    hole = 0.62 * height
    share = np.linspace(0, 1, 65)
    angle = np.pi * (1 - share)
    inner = hole * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turns = [0.0, 0.25, 0.75, 1.0]
    across = np.interp(share, turns, [-width / 2, -width / 2, width / 2, width / 2])
    outer = np.stack([across, np.interp(share, turns, [0.0, height, height, 0.0])], axis=1)
    bevel = 0.0015
    rings = []
    for rim_in, rim_out in zip(inner, outer, strict=True):
        wall = rim_out - rim_in
        length = np.linalg.norm(wall)
        half = depth / 2
        back = [(0.0, half - bevel), (bevel, half), (length - bevel, half), (length, half - bevel)]
        chamfered = back + [(t, -y) for t, y in reversed(back)]
        rings.append([_between(rim_in, wall / length, t, y) for t, y in chamfered])
    stack = np.array(rings)
    ends = [np.broadcast_to(ring.mean(axis=0), (1, *ring.shape)) for ring in (stack[0], stack[-1])]
    surface = skin(np.concatenate([ends[0], stack, ends[1]]))
    parts = []
    for low in (0, 16, 32, 48):
        span = [low, low + 8, low + 16]
        parts.append(collision.convex(stack[span].reshape(-1, 3)))
    solid = Solid.of(surface, _painted_wood(color, seed, (96, 128)))
    return Shape(solids=[solid], collision=parts, gloss=0.2)


def _between(start: np.ndarray, along: np.ndarray, t: float, y: float) -> np.ndarray:
    """Return the point (x, y, z) that lies `t` metres from `start` in the xz plane."""
    x, z = start + t * along
    return np.array([x, y, z])


def airplane(*, length_m: float, span_m: float, body: Color, wing: Color, seed: int) -> Shape:
    """Shape a toy aeroplane on its wheels, nose towards +x."""
    radius, height, thickness = 0.105 * length_m, 0.20 * length_m, 0.035 * length_m
    x = np.array([-0.5, -0.48, -0.30, -0.05, 0.20, 0.38, 0.45, 0.47]) * length_m
    share = np.array([0.18, 0.26, 0.58, 0.95, 1.0, 0.86, 0.62, 0.40])
    lift = np.array([0.45, 0.44, 0.25, 0.05, 0, 0, 0, 0]) * radius
    path = np.stack([x, 0 * x, height + lift], axis=1)
    fuselage = sweep(path, radius * np.stack([share, share], 1), num_columns=24)
    main_wing = _wing(0.26 * length_m, span_m, thickness, sweepback=0.05 * length_m)
    wing_at = (0.08 * length_m, 0, height - 0.65 * radius)
    tail_wing = _wing(0.15 * length_m, 0.40 * span_m, 0.7 * thickness, sweepback=0.02 * length_m)
    tail_at = (-0.42 * length_m, 0, height + 0.40 * radius)
    fin = _wing(0.15 * length_m, 0.40 * length_m, 0.7 * thickness, sweepback=0.06 * length_m)
    fin_at = (-0.42 * length_m, 0, height + 0.3 * radius)
    upright = Rotation.from_euler("x", 90, degrees=True)
    gear, gear_parts = _wheels(length_m, radius, height)
    solids = [
        Solid.of(fuselage, _hull_image(body, wing, seed)),
        Solid.of(main_wing.moved(wing_at), plain(wing)),
        Solid.of(tail_wing.moved(tail_at), plain(wing)),
        Solid.of(fin.moved(fin_at, upright), plain(wing)),
        *_cockpit_and_propeller(length_m, radius, height),
        *gear,
    ]
    fin_middle = (-0.43 * length_m, 0, fin_at[2] + 0.10 * length_m)
    parts = [
        collision.convex(_hull_points(path[[1, 3, 4]], radius * share[[1, 3, 4]])),
        collision.convex(_hull_points(path[[4, 5, 7]], radius * share[[4, 5, 7]])),
        collision.box((0.24 * length_m, span_m, thickness), wing_at),
        collision.box((0.14 * length_m, 0.40 * span_m, 0.7 * thickness), tail_at),
        collision.box((0.11 * length_m, 0.7 * thickness, 0.20 * length_m), fin_middle),
        *gear_parts,
    ]
    return Shape(solids=solids, collision=parts, gloss=0.4)


def _hull_image(body: Color, nose: Color, seed: int) -> np.ndarray:
    """Paint the fuselage: nose in the colour of the wings, a row of windows on each side."""
    hull = Poster(body, (160, 160)).rectangle((0, 0.0, 1, 0.12), nose)
    for window in range(4):
        top = 0.24 + 0.09 * window
        for flank in (0.02, 0.42, 0.92):
            hull.ellipse((flank, top, flank + 0.06, top + 0.05), _GLASS)
    grain = noise(np.random.default_rng(seed), (160, 160), (6, 6), 2)
    return as_image(hull.image() + 4 * grain[..., None])


def _cockpit_and_propeller(length: float, hull: float, height: float) -> list[Solid]:
    """Build the canopy, the spinner and two crossed blades."""
    glass = ellipsoid((0.11 * length, 0.6 * hull, 0.75 * hull), num_rings=11, num_columns=18)
    glass = glass.moved((0.17 * length, 0, height + 0.72 * hull))
    spinner = ellipsoid((0.05 * length, 0.42 * hull, 0.42 * hull), num_rings=9, num_columns=14)
    spinner = spinner.moved((0.475 * length, 0, height))
    solids = [Solid.of(glass, plain(_GLASS)), Solid.of(spinner, plain((230, 190, 50)))]
    blade = ellipsoid((0.008 * length + 0.0008, 0.026 * length, 0.17 * length), num_columns=14)
    for turn in (25, 115):
        rotation = Rotation.from_euler("x", turn, degrees=True)
        spun = blade.moved((0.485 * length, 0, height), rotation)
        solids.append(Solid.of(spun, plain((60, 60, 64))))
    return solids


def _wing(chord: float, span: float, thickness: float, sweepback: float) -> Surface:
    """Make a flat wing about the origin: chord along x, span along y, rounded tips."""
    outline = circle(48, 4.0, span / chord) * (chord / 2)
    narrow = 1 - 0.30 * np.abs(outline[:, 1]) / (span / 2)
    outline[:, 0] = outline[:, 0] * narrow - sweepback * np.abs(outline[:, 1]) / (span / 2)
    return plate(outline, thickness, bevel_m=0.35 * thickness, base_m=-thickness / 2)


def _hull_points(centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return octagons about x at three stations of the fuselage, (24, 3)."""
    ring = circle(8)
    octagons = [
        center + np.column_stack([np.zeros(8), ring * radius])
        for center, radius in zip(centers, radii, strict=True)
    ]
    return np.concatenate(octagons)


def _wheels(
    length: float, hull: float, height: float
) -> tuple[list[Solid], list[collision.CollisionPart]]:
    """Build two wheels under the wings and one at the tail, with struts."""
    solids, parts = [], []
    places = [(0.16, 0.13, 0.062), (0.16, -0.13, 0.062), (-0.40, 0.0, 0.035)]
    for x, y, radius in places:
        center = np.array([x, y, radius]) * length
        half = np.array([0, 0.022 * length, 0])
        path = np.stack([center - half, center + half])
        wheel = sweep(path, radius * length, num_columns=20)
        solids.append(Solid.of(wheel, plain((40, 40, 44))))
        top = np.array([x * length, 0.4 * y * length, height - 0.2 * hull])
        strut = sweep(np.stack([center, top]), 0.013 * length, num_columns=10, up=(1, 0, 0))
        solids.append(Solid.of(strut, plain((150, 152, 158))))
        parts.append(collision.rod(radius * length, path[0], path[1]))
        parts.append(collision.capsule(0.013 * length, center, top))
    return solids, parts
