"""Groceries that are neither plain cans nor plain cartons: drink cans, jars, milk, tissues."""

import zlib

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Panel, Solid, box_solid
from models.objects.paint import (
    STEEL,
    WHITE,
    Color,
    Poster,
    as_image,
    mottled,
    noise,
    plain,
    shade,
)
from models.objects.surface import circle, disc, ellipsoid, revolve, skin, sweep


def drink_can(
    *, diameter_m: float, height_m: float, title: str, color: Color, swoosh: Color, seed: int
) -> Shape:
    """Shape a drink can: necked ends, recessed lid with a tab, a swoosh around the label."""
    rng = np.random.default_rng(seed)
    r, h = diameter_m / 2, height_m
    lid = h - 0.0035
    side = np.array(
        [(0.72 * r, 0.0), (0.78 * r, 0.0), (0.97 * r, 0.006), (r, 0.010)]
        + [(r, z) for z in np.linspace(0.2 * h, h - 0.018, 5)]
        + [(0.96 * r, h - 0.012), (0.83 * r, h - 0.003), (0.83 * r, h), (0.79 * r, h)]
        + [(0.77 * r, lid)]
    )
    levels = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(side, axis=0), axis=1))])
    wall = revolve(side, num_columns=48, v=levels / levels[-1])
    ends = []
    for radius, z in ((0.72 * r, 0.0), (0.77 * r, lid)):
        ring = np.column_stack([circle(48) * radius, np.full(48, z)])
        ends.append(Panel(surface=disc(ring, faces_up=z > 0), image=_can_end(rng)))
    label = _swoosh(title, color, swoosh, rng)
    tab = ellipsoid((0.30 * r, 0.17 * r, 0.0010), num_rings=7, num_columns=20)
    solids = [
        Solid(panels=(Panel(surface=wall, image=label), *ends)),
        Solid.of(tab.moved((0.10 * r, 0, lid + 0.0008)), plain((206, 208, 214))),
    ]
    parts = [
        collision.cylinder(0.82 * r, 0.0, h),
        collision.cylinder(r, 0.008, h - 0.014),
    ]
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.7)


def _can_end(rng: np.random.Generator) -> np.ndarray:
    """Paint an aluminium end with its rim and opening."""
    y, x = np.mgrid[-1:1:80j, -1:1:80j]
    radius = np.hypot(x, y)
    image = (
        np.asarray((196, 198, 204), float) + 8 * noise(rng, radius.shape, (30, 30), 1)[..., None]
    )
    image[np.abs(radius - 0.86) < 0.05] *= 0.8
    image[np.abs(np.hypot((x + 0.40) / 1.2, y) - 0.36) < 0.04] *= 0.7
    return as_image(image)


def _swoosh(title: str, color: Color, swoosh: Color, rng: np.random.Generator) -> np.ndarray:
    """Print a drink can's label: the title reads upwards twice, a wave runs around."""
    poster = Poster(color, (224, 448))
    x = np.linspace(0, 1, 60)
    for shift, thick in ((0.0, 0.13), (0.16, 0.03)):
        wave = 0.60 + shift + 0.10 * np.sin(4 * np.pi * x)
        upper = np.stack([x, wave - thick / 2], axis=1)
        lower = np.stack([x, wave + thick / 2], axis=1)[::-1]
        poster.polygon([*upper.tolist(), *lower.tolist()], swoosh)
    for left in (0.0, 0.5):
        poster.words(title, (left + 0.06, 0.12, left + 0.21, 0.90), WHITE, shade(color, 0.5), 90)
        poster.small_print((left + 0.40, 0.18, left + 0.47, 0.46), WHITE, 8)
    poster.barcode(rng, (0.32, 0.76, 0.40, 0.92))
    return poster.rectangle((0, 0, 1, 0.10), STEEL).rectangle((0, 0.95, 1, 1), STEEL).image()


def jar(
    *,
    diameter_m: float,
    height_m: float,
    content: Color,
    lid: Color,
    paper: Color,
    title: str,
    seed: int,
) -> Shape:
    """Shape a jar whose content shows around a paper label, with a screw lid."""
    rng = np.random.default_rng([seed, zlib.crc32(title.encode())])
    r, base = diameter_m / 2, height_m - 0.016
    profile = [(0, 0), (0.86 * r, 0), (0.97 * r, 0.004), (r, 0.010)]
    profile += [(r, z) for z in np.linspace(0.2 * base, base - 0.016, 6)]
    profile += [(0.97 * r, base - 0.010), (0.82 * r, base - 0.002), (0.80 * r, base), (0, base)]
    # Texture by height, so that the label lies level; the flat ends take the edge's colour.
    levels = np.array([z for _, z in profile]) / base
    body = revolve(profile, num_columns=48, v=levels)
    mix = mottled(rng, content, shade(content, 0.8), (192, 416), (8, 16))
    poster = Poster(paper, (192, 416))
    for left in (0.03, 0.53):
        poster.words(title, (left + 0.05, 0.30, left + 0.35, 0.58), shade(lid, 0.8))
        poster.ellipse((left + 0.15, 0.60, left + 0.25, 0.76), content)
        poster.small_print((left + 0.43, 0.34, left + 0.47, 0.72), shade(paper, 0.6), 6)
    image = mix.copy()
    image[48:154] = poster.image()[48:154]
    cap_r = 0.90 * r
    cap = [(0, base - 0.002), (cap_r, base - 0.002)]
    cap += [(cap_r, z) for z in np.linspace(base + 0.002, height_m - 0.0015, 4)]
    cap += [(cap_r - 0.0015, height_m), (0, height_m)]
    ribs = Poster(lid, (16, 160))
    for rib in range(40):
        ribs.rectangle((rib / 40, 0.45, (rib + 0.4) / 40, 0.80), shade(lid, 0.8))
    solids = [Solid.of(body, image), Solid.of(revolve(cap, num_columns=40), ribs.image())]
    parts = [
        collision.cylinder(r, 0.0, base - 0.008),
        collision.cylinder(cap_r, base - 0.008, height_m),
    ]
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.7)


def gable_carton(
    *,
    edge_m: float,
    height_m: float,
    title: str,
    subtitle: str,
    color: Color,
    ink: Color,
    seed: int,
) -> Shape:
    """Shape a drink carton with a gable top and a square foot of `edge_m`."""
    rng = np.random.default_rng(seed)
    wall = 0.72 * height_m
    ridge = 0.93 * height_m
    front = Poster(WHITE, (176, 112)).rectangle((0, 0, 1, 0.16), color)
    x = np.linspace(0, 1, 30)
    crest = np.stack([x, 0.64 + 0.05 * np.sin(2 * np.pi * x)], axis=1)
    front.polygon([*crest.tolist(), (1, 1), (0, 1)], color)
    front.words(title, (0.08, 0.20, 0.92, 0.44), ink).words(subtitle, (0.15, 0.47, 0.85, 0.58), ink)
    front.ellipse((0.34, 0.70, 0.66, 0.92), WHITE)
    side = Poster(color, (176, 112)).rectangle((0.12, 0.30, 0.88, 0.72), WHITE)
    side.small_print((0.18, 0.34, 0.82, 0.68), shade(color, 0.6), 9)
    side.barcode(rng, (0.2, 0.78, 0.8, 0.94))
    flat = plain(color)
    images = [side.image(), side.image(), front.image(), front.image(), flat, flat]
    solids = [box_solid((edge_m, edge_m, wall), 0.0015, images, (0, 0, wall / 2))]
    square = circle(48, 40.0) * (edge_m / 2 - 0.0002)
    t = np.linspace(0, 1, 6)
    rings = [np.column_stack([square * 0, np.full(48, wall - 0.004)])]
    rings.append(np.column_stack([square, np.full(48, wall - 0.004)]))
    rings += [
        np.column_stack([square * [1, 1 - 0.97 * s], np.full(48, wall + (ridge - wall) * s)])
        for s in t
    ]
    rings.append(np.column_stack([square * [0, 0], np.full(48, ridge)]))
    roof = Poster(color, (64, 96)).rectangle((0.08, 0.2, 0.42, 0.5), WHITE)
    solids.append(Solid.of(skin(np.stack(rings)), roof.image()))
    fin = (edge_m, 0.005, height_m - ridge + 0.006)
    fin_at = (0, 0, height_m - fin[2] / 2)
    solids.append(box_solid(fin, 0.001, plain(shade(color, 0.9)), fin_at))
    half = edge_m / 2
    gable = [(x, y, wall) for x in (-half, half) for y in (-half, half)]
    gable += [(x, y, ridge) for x in (-half, half) for y in (-0.002, 0.002)]
    parts = [
        collision.box((edge_m, edge_m, wall), (0, 0, wall / 2)),
        collision.convex(np.array(gable)),
        collision.box(fin, fin_at),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.3)


def tissue_box(
    *, size_m: tuple[float, float, float], color: Color, dots: Color, seed: int
) -> Shape:
    """Shape a box of tissues with one tissue standing out of its oval opening."""
    rng = np.random.default_rng(seed)
    width, _, height = size_m
    spots = _spotted(rng, color, dots, (96, 144))
    small = _spotted(rng, color, dots, (96, 96))
    top = Poster(color, (96, 144)).ellipse((0.20, 0.26, 0.80, 0.74), shade(color, 0.25)).image()
    images = [small, small, spots, spots, top, plain(color)]
    solids = [box_solid(size_m, 0.0015, images, (0, 0, height / 2))]
    turn = np.arange(60) * (2 * np.pi / 60)
    folds = (
        circle(60, 2.0, 0.45) * (1 + 0.18 * np.sin(7 * turn) + 0.07 * np.sin(13 * turn))[:, None]
    )
    t = np.linspace(0, 1, 9)
    profile = np.stack([0.20 * width * (1 + 0.25 * t - 0.75 * t**3), 0.030 * t], axis=1)
    profile = np.concatenate([[(0.0, 0.0)], profile, [(0.0, 0.027)]])
    plume = revolve(profile, section=folds).moved((0, 0, height - 0.002))
    paper = as_image(246 + 9 * noise(rng, (48, 96), (4, 24), 2)[..., None] * np.ones(3))
    solids.append(Solid.of(plume, paper))
    parts = [
        collision.box(size_m, (0, 0, height / 2)),
        collision.ellipsoid((0.20 * width, 0.10 * width, 0.020), (0, 0, height + 0.004)),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.2)


def _spotted(
    rng: np.random.Generator, color: Color, dots: Color, shape: tuple[int, int]
) -> np.ndarray:
    """Print a pattern of dots."""
    poster = Poster(color, shape)
    wide = shape[0] / shape[1]
    for row in range(4):
        for column in range(round(4 / wide)):
            x = (column + 0.25 + 0.5 * (row % 2)) * wide / 4 + rng.uniform(-0.01, 0.01)
            y = (row + 0.5) / 4
            poster.ellipse((x - 0.06 * wide, y - 0.06, x + 0.06 * wide, y + 0.06), dots)
    return poster.image()


def lid(*, diameter_m: float, height_m: float, color: Color, seed: int) -> Shape:
    """Shape the lid of a pitcher: a rimmed disc with a bar to hold it by."""
    rng = np.random.default_rng(seed)
    r, skirt = diameter_m / 2, 0.5 * height_m
    profile = [(0, 0), (0.88 * r, 0), (0.90 * r, 0.001), (0.90 * r, 0.7 * skirt), (r, 0.7 * skirt)]
    profile += [(r, skirt - 0.001), (0.985 * r, skirt), (0.86 * r, skirt), (0.84 * r, 0.8 * skirt)]
    profile += [(0.4 * r, 0.78 * skirt), (0, 0.78 * skirt)]
    image = mottled(rng, color, shade(color, 0.94), (96, 96))
    x = np.linspace(-0.72, 0.72, 13) * r
    rise = 0.78 * skirt + (height_m - 0.78 * skirt - 0.004) * (1 - (x / (0.8 * r)) ** 4)
    path = np.stack([x, 0 * x, rise], axis=1)
    bar = sweep(path, np.array([[0.007, 0.004]] * 13), section=circle(20, 3.0), up=(0, 0, 1))
    solids = [Solid.of(revolve(profile, num_columns=56), image)]
    solids.append(Solid.of(bar, plain(shade(color, 0.85))))
    parts = [
        collision.cylinder(0.90 * r, 0.0, 0.75 * skirt),
        collision.cylinder(r, 0.7 * skirt, skirt),
        collision.box(
            (1.2 * r, 0.014, height_m - 0.75 * skirt), (0, 0, (height_m + 0.75 * skirt) / 2)
        ),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.4)
