"""Things of desk and pocket: telephone, calculator, camera, glasses case, candle, stapler."""

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid, box_solid
from models.objects.paint import BLACK, WHITE, Color, Poster, mottled, noise, plain, shade
from models.objects.surface import circle, revolve, sweep


def telephone(
    *, size_m: tuple[float, float, float], frame: Color, screen: Color, seed: int
) -> Shape:
    """Shape a smart telephone lying on its back: home screen with icons, camera behind."""
    rng = np.random.default_rng(seed)
    face = Poster(frame, (144, 288))
    face.rectangle((0.03, 0.05, 0.97, 0.95), screen, radius=0.02)
    icons: list[Color] = [(240, 90, 70), (250, 190, 60), (90, 190, 110), (70, 130, 230), WHITE]
    for column in range(6):
        for row in range(4):
            x, y = 0.10 + 0.125 * column, 0.12 + 0.20 * row
            icon = icons[rng.integers(len(icons))]
            face.rectangle((x, y, x + 0.075, y + 0.14), icon, radius=0.014)
    face.rectangle((0.90, 0.12, 0.95, 0.88), shade(screen, 1.4, 20), radius=0.01)
    back = Poster(frame, (72, 144)).rectangle((0.05, 0.08, 0.22, 0.52), BLACK, radius=0.03)
    return _slab(size_m, face.image(), back.image(), plain(shade(frame, 1.2, 20)), 0.35)


def calculator(*, size_m: tuple[float, float, float], color: Color, key: Color, seed: int) -> Shape:
    """Shape a pocket calculator lying on its back, its display at +x."""
    rng = np.random.default_rng(seed)
    face = Poster(color, (144, 240))
    face.rectangle((0.74, 0.10, 0.94, 0.90), (178, 196, 168), radius=0.01)
    face.words("1089", (0.77, 0.16, 0.91, 0.80), (36, 44, 36), turn_deg=270)
    signs = "C/*-789+456=123.0"
    for column in range(5):
        for row in range(4):
            x, y = 0.60 - 0.135 * column, 0.10 + 0.205 * row
            tone = (226, 120, 40) if row == 3 else key
            face.rectangle((x, y, x + 0.105, y + 0.165), tone, radius=0.012)
            sign = signs[(4 * column + row) % len(signs)]
            area = (x + 0.02, y + 0.035, x + 0.085, y + 0.13)
            face.words(sign, area, (20, 20, 22), turn_deg=270)
    rest = mottled(rng, color, shade(color, 0.92), (32, 64))
    return _slab(size_m, face.image(), rest, rest, 0.3)


def _slab(
    size: tuple[float, float, float],
    face: np.ndarray,
    back: np.ndarray,
    rim: np.ndarray,
    roundness: float,
) -> Shape:
    """Shape a flat device with a picture on its face."""
    center = (0, 0, size[2] / 2)
    solid = box_solid(size, roundness * size[2], [rim] * 4 + [face, back], center)
    return Shape(solids=[solid], collision=[collision.box(size, center)], gloss=0.6)


def camera(*, size_m: tuple[float, float, float], body: Color, trim: Color, seed: int) -> Shape:
    """Shape a compact camera that looks towards -y; height is without the shutter button."""
    rng = np.random.default_rng(seed)
    width, depth, height = size_m
    leather = mottled(rng, body, shade(body, 0.8), (80, 128), (24, 40))
    front = Poster(body, (96, 160)).rectangle((0, 0, 1, 0.26), trim)
    front.rectangle((0.06, 0.05, 0.24, 0.21), (240, 244, 248))
    front.words("FOTO", (0.62, 0.05, 0.94, 0.22), BLACK)
    rear = Poster(body, (96, 160)).rectangle((0.08, 0.16, 0.66, 0.88), (30, 44, 60), radius=0.02)
    for x, y in ((0.76, 0.30), (0.88, 0.30), (0.76, 0.55), (0.88, 0.55)):
        rear.ellipse((x - 0.04, y - 0.07, x + 0.04, y + 0.07), trim)
    top = Poster(trim, (48, 96)).image()
    images = [leather, leather, rear.image(), front.image(), top, plain(body)]
    solids = [box_solid(size_m, 0.12 * depth, images, (0, 0, height / 2))]
    lens = np.array([0.05 * width, 0, 0.45 * height])
    radius = 0.33 * height
    steps = np.array([0.40, 0.52, 0.60, 0.78, 0.80, 0.86, 0.861, 0.862]) * depth
    sizes = np.array([1.0, 1.0, 0.95, 0.95, 0.86, 0.86, 0.66, 0.30]) * radius
    path = lens - np.stack([0 * steps, steps, 0 * steps], axis=1)
    glass = Poster(BLACK, (96, 32)).rectangle((0, 0.0, 1, 0.16), (36, 52, 92))
    glass.rectangle((0, 0.36, 1, 0.40), trim)
    solids.append(Solid.of(sweep(path, sizes, num_columns=36), glass.image()))
    button = revolve([(0, 0), (0.006, 0), (0.006, 0.003), (0.005, 0.004), (0, 0.004)])
    spot = (-0.36 * width, 0, height - 0.0005)
    solids.append(Solid.of(button.moved(spot), plain((196, 40, 40))))
    parts = [
        collision.box(size_m, (0, 0, height / 2)),
        collision.rod(0.95 * radius, path[0], path[-1]),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.4)


def glasses_case(
    *, size_m: tuple[float, float, float], color: Color, lining: Color, seed: int
) -> Shape:
    """Shape a closed hard case: leather shell, seam all around, clasp in front."""
    rng = np.random.default_rng(seed)
    length, width, height = size_m
    leather = mottled(rng, color, shade(color, 0.86), (64, 128), (20, 40))
    flank = Poster(color, (64, 160)).rectangle((0, 0.45, 1, 0.53), lining)
    clasp = Poster(color, (64, 160)).rectangle((0, 0.45, 1, 0.53), lining)
    clasp.rectangle((0.44, 0.34, 0.56, 0.66), (206, 178, 96), radius=0.02)
    top = Poster(color, (64, 160)).words("OPTIC", (0.32, 0.34, 0.68, 0.66), lining).image()
    images = [flank.image(), flank.image(), flank.image(), clasp.image(), top, leather]
    solid = box_solid(size_m, 0.40 * height, images, (0, 0, height / 2))
    corners = [
        (1, 0.7),
        (0.9, 1),
        (-0.9, 1),
        (-1, 0.7),
        (-1, -0.7),
        (-0.9, -1),
        (0.9, -1),
        (1, -0.7),
    ]
    rim = np.array(corners) * [length / 2, width / 2]
    inset = rim - np.sign(rim) * 0.2 * height
    layers = [(inset, 0.0), (rim, 0.35), (rim, 0.65), (inset, 1.0)]
    hull = [np.column_stack([xy, np.full(8, z * height)]) for xy, z in layers]
    parts = [collision.convex(np.concatenate(hull))]
    return Shape(solids=[solid], collision=parts, gloss=0.4)


def candle(*, diameter_m: float, height_m: float, wax: Color, band: Color, seed: int) -> Shape:
    """Shape a pillar candle with a burnt wick."""
    rng = np.random.default_rng(seed)
    r, h = diameter_m / 2, height_m
    profile = [(0, 0), (r - 0.001, 0), (r, 0.001)]
    profile += [(r, z) for z in np.linspace(0.1 * h, h - 0.003, 8)]
    profile += [(r - 0.002, h), (0.75 * r, h - 0.001), (0.30 * r, h - 0.003), (0, h - 0.003)]
    poster = Poster(wax, (160, 160)).rectangle((0, 0.62, 1, 0.80), band)
    drips = poster.image() + 7 * noise(rng, (160, 160), (3, 24), 3)[..., None]
    path = np.array([(0, 0, h - 0.006), (0, 0, h + 0.003), (0.002, 0, h + 0.008)])
    wick = sweep(path, 0.0012, num_columns=10, up=(0, 1, 0))
    solids = [
        Solid.of(revolve(profile, num_columns=48), np.clip(drips, 0, 255).astype(np.uint8)),
        Solid.of(wick, plain((40, 34, 30))),
    ]
    return Shape(solids=solids, collision=[collision.cylinder(r, 0, h)], rolls=True, gloss=0.3)


def stapler(*, length_m: float, width_m: float, height_m: float, color: Color, seed: int) -> Shape:
    """Shape a desk stapler: flat foot, arched arm that narrows towards its mouth at +x."""
    rng = np.random.default_rng(seed)
    foot = (length_m, width_m, 0.007)
    coat = mottled(rng, color, shade(color, 0.94))
    solids = [box_solid(foot, 0.0025, mottled(rng, (60, 62, 66), (50, 52, 56)), (0, 0, 0.0035))]
    rail = (0.90 * length_m, 0.55 * width_m, 0.006)
    rail_at = (0.02 * length_m, 0, 0.42 * height_m)
    solids.append(box_solid(rail, 0.0008, plain((178, 182, 190)), rail_at))
    x = np.array([-0.50, -0.49, -0.40, -0.10, 0.25, 0.46, 0.50]) * length_m
    top = np.array([0.70, 0.85, 0.97, 1.0, 0.90, 0.72, 0.66]) * height_m
    low = np.array([0.06, 0.06, 0.06, 0.40, 0.44, 0.44, 0.48]) * height_m + 0.003
    path = np.stack([x, 0 * x, (top + low) / 2], axis=1)
    sizes = np.stack(
        [np.array([0.40, 0.46, 0.5, 0.5, 0.46, 0.40, 0.30]) * width_m, (top - low) / 2], 1
    )
    solids.append(Solid.of(sweep(path, sizes, section=circle(28, 4.0)), coat))
    parts = [
        collision.box(foot, (0, 0, 0.0035)),
        collision.box(
            (0.25 * length_m, 0.92 * width_m, 0.90 * height_m),
            (-0.375 * length_m, 0, 0.47 * height_m),
        ),
        collision.box(
            (0.75 * length_m, 0.84 * width_m, 0.46 * height_m),
            (0.12 * length_m, 0, 0.65 * height_m),
        ),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.5)
