"""Things to play with on a table: toy brick, puzzle cube, die, ring, pawn, nut."""

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid, box_solid
from models.objects.paint import Color, Poster, as_image, mottled, noise, plain, shade
from models.objects.surface import circle, revolve, skin, sweep

_STICKERS: tuple[Color, ...] = (
    (196, 30, 42),
    (240, 120, 24),
    (30, 90, 190),
    (30, 150, 70),
    (240, 240, 236),
    (244, 210, 40),
)


def brick(
    *, num_studs: tuple[int, int], pitch_m: float, height_m: float, color: Color, seed: int
) -> Shape:
    """Shape a toy building brick with studs on top, `pitch_m` apart."""
    rng = np.random.default_rng(seed)
    columns, rows = num_studs
    size = (columns * pitch_m - 0.0002, rows * pitch_m - 0.0002, height_m)
    image = mottled(rng, color, shade(color, 0.96))
    radius, stud_height = 0.30 * pitch_m, 0.22 * pitch_m
    profile = [(0, -0.002), (radius, -0.002), (radius, 0.8 * stud_height)]
    profile += [(0.92 * radius, stud_height), (0, stud_height)]
    stud = revolve(profile, num_columns=20)
    face = plain(shade(color, 1.06, 6))
    solids = [box_solid(size, 0.0008, image, (0, 0, height_m / 2))]
    for column in range(columns):
        for row in range(rows):
            x, y = (column - (columns - 1) / 2) * pitch_m, (row - (rows - 1) / 2) * pitch_m
            solids.append(Solid.of(stud.moved((x, y, height_m)), face))
    # One slab stands for all studs: too shallow to catch anything between them.
    span = (size[0] - 0.4 * pitch_m, size[1] - 0.4 * pitch_m, stud_height)
    parts = [
        collision.box(size, (0, 0, height_m / 2)),
        collision.box(span, (0, 0, height_m + stud_height / 2)),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.5)


def puzzle_cube(*, edge_m: float, seed: int) -> Shape:
    """Shape a scrambled puzzle cube of three by three stickers a side."""
    rng = np.random.default_rng(seed)
    scrambled = rng.permutation(np.repeat(np.arange(6), 9)).reshape(6, 3, 3)
    faces = []
    for side in scrambled:
        poster = Poster((22, 22, 24), (108, 108))
        for row in range(3):
            for column in range(3):
                x, y = 0.035 + 0.32 * column, 0.035 + 0.32 * row
                sticker = _STICKERS[side[row, column]]
                poster.rectangle((x, y, x + 0.29, y + 0.29), sticker, radius=0.04)
        faces.append(poster.image())
    solid = box_solid([edge_m] * 3, 0.0018, faces, (0, 0, edge_m / 2))
    parts = [collision.box([edge_m] * 3, (0, 0, edge_m / 2))]
    return Shape(solids=[solid], collision=parts, gloss=0.4)


def die(*, edge_m: float, color: Color, pips: Color, seed: int) -> Shape:
    """Shape a large die; opposite faces add up to seven."""
    rng = np.random.default_rng(seed)
    faces = [_pips(rng, color, pips, value) for value in (3, 4, 2, 5, 1, 6)]
    solid = box_solid([edge_m] * 3, 0.14 * edge_m, faces, (0, 0, edge_m / 2))
    parts = [collision.box([edge_m] * 3, (0, 0, edge_m / 2))]
    return Shape(solids=[solid], collision=parts, gloss=0.3)


def _pips(rng: np.random.Generator, color: Color, ink: Color, value: int) -> np.ndarray:
    """Paint one face of a die."""
    corner = [(0.26, 0.26), (0.74, 0.74), (0.74, 0.26), (0.26, 0.74), (0.26, 0.5), (0.74, 0.5)]
    places = corner[: value - value % 2] + ([(0.5, 0.5)] if value % 2 else [])
    poster = Poster(color, (96, 96))
    for x, y in places:
        poster.ellipse((x - 0.095, y - 0.095, x + 0.095, y + 0.095), ink)
    return as_image(poster.image() + 3 * noise(rng, (96, 96), (8, 8), 2)[..., None])


def ring(*, outer_m: float, tube_m: float, color: Color, stripe: Color, seed: int) -> Shape:
    """Shape a rubber ring lying flat; `tube_m` is the thickness of its tube."""
    rng = np.random.default_rng(seed)
    turn = np.arange(60) * (2 * np.pi / 60)
    middle = (outer_m - tube_m) / 2
    hoop = np.stack([middle * np.cos(turn), middle * np.sin(turn), 0 * turn + tube_m / 2], axis=1)
    surface = sweep(hoop, tube_m / 2, num_columns=20, loop=True)
    poster = Poster(color, (192, 48))
    for band in range(4):
        poster.rectangle((0, band / 4, 1, band / 4 + 0.09), stripe)
    image = as_image(poster.image() + 5 * noise(rng, (192, 48), (12, 3), 2)[..., None])
    corners = hoop[np.arange(0, 61, 5) % 60]
    parts = collision.capsule_chain(tube_m / 2, corners)
    return Shape(solids=[Solid.of(surface, image)], collision=parts, rolls=True, gloss=0.3)


def pawn(*, height_m: float, base_m: float, color: Color, seed: int) -> Shape:
    """Shape a turned pawn: foot, waist, collar and round head; `base_m` is the foot's diameter."""
    rng = np.random.default_rng(seed)
    foot, head = base_m / 2, 0.30 * base_m
    head_z = height_m - head
    below = np.array(
        [
            (0, 0),
            (1, 0),
            (1, 0.09),
            (0.94, 0.12),
            (0.80, 0.16),
            (0.84, 0.20),
            (0.52, 0.30),
            (0.36, 0.45),
            (0.32, 0.55),
            (0.31, 0.60),
            (0.62, 0.64),
            (0.62, 0.67),
            (0.36, 0.70),
        ]
    ) * [foot, height_m]
    latitude = np.linspace(-0.9, np.pi / 2, 12)
    ball = np.stack([head * np.cos(latitude), head_z + head * np.sin(latitude)], axis=1)
    ball[-1, 0] = 0.0
    surface = revolve(np.concatenate([below, ball]), num_columns=40)
    image = mottled(rng, color, shade(color, 0.88), (96, 64))
    parts = [
        collision.cylinder(foot, 0.0, 0.15 * height_m),
        collision.cylinder(0.45 * foot, 0.15 * height_m, 0.62 * height_m),
        collision.cylinder(0.62 * foot, 0.62 * height_m, 0.68 * height_m),
        collision.sphere(head, (0, 0, head_z)),
    ]
    return Shape(solids=[Solid.of(surface, image)], collision=parts, rolls=True, gloss=0.5)


def nut(*, width_m: float, hole_m: float, height_m: float, color: Color, seed: int) -> Shape:
    """Shape a toy nut: a hexagonal ring lying flat, `width_m` across its flats."""
    rng = np.random.default_rng(seed)
    num = 72
    turn = np.arange(num) * (2 * np.pi / num)
    flat = width_m / 2 / np.cos((turn + np.pi / 6) % (np.pi / 3) - np.pi / 6)
    outside, inside = flat[:, None] * circle(num), hole_m / 2 * circle(num)
    bevel = 0.04 * width_m
    layers = [(inside, 0.0), (outside * 0.96, 0.0), (outside, bevel)]
    layers += [(outside, height_m - bevel), (outside * 0.96, height_m), (inside, height_m)]
    threads = [(inside * (1 + 0.03 * (k % 2)), height_m * (1 - k / 8)) for k in range(1, 8)]
    rings = [np.column_stack([xy, np.full(num, z)]) for xy, z in layers + threads]
    surface = skin(np.stack(rings), loop=True)
    image = mottled(rng, color, shade(color, 0.90), (64, 96))
    parts = []
    for sector in range(6):
        low, high = 12 * sector, (12 * sector + 12) % num
        outline = np.stack([inside[low], outside[low], outside[high], inside[high]])
        parts.append(collision.prism(outline, 0.0, height_m))
    turned = Rotation.from_euler("z", 15, degrees=True)
    return Shape(
        solids=[Solid.of(surface.moved(rotation=turned), image)],
        collision=[part.moved(rotation=turned) for part in parts],
        gloss=0.4,
    )
