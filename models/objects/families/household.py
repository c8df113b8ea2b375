"""Small things about the house: soap, soap dish, computer mouse, remote control, tape, markers."""

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Panel, Solid
from models.objects.paint import (
    BLACK,
    WHITE,
    Color,
    Poster,
    as_image,
    grid,
    lay,
    mottled,
    noise,
    plain,
    shade,
)
from models.objects.surface import circle, revolve, rounded_box, skin, sweep


def soap(*, size_m: tuple[float, float, float], color: Color, words: str, seed: int) -> Shape:
    """Shape a bar of soap with soft edges and a stamped word."""
    rng = np.random.default_rng(seed)
    pressed = shade(color, 0.72)
    stamp = Poster(color, (144, 224)).ellipse((0.08, 0.12, 0.92, 0.88), pressed)
    stamp.ellipse((0.10, 0.15, 0.90, 0.85), color)
    face = stamp.words(words, (0.2, 0.28, 0.8, 0.72), pressed).image()
    rest = mottled(rng, color, shade(color, 0.95))
    sides = rounded_box(size_m, 0.42 * size_m[2], num_round=4)
    images = [rest, rest, rest, rest, face, face]
    panels = tuple(
        Panel(surface=s.moved((0, 0, size_m[2] / 2)), image=i)
        for s, i in zip(sides, images, strict=True)
    )
    rim = circle(8, 4.0, size_m[1] / size_m[0]) * (size_m[0] / 2)
    inset = rim * (1 - 0.5 * size_m[2] / size_m[0])
    layers = [(inset, 0.0), (rim, 0.35), (rim, 0.65), (inset, 1.0)]
    hull = [np.column_stack([xy, np.full(8, z * size_m[2])]) for xy, z in layers]
    parts = [collision.convex(np.concatenate(hull))]
    return Shape(solids=[Solid(panels=panels)], collision=parts, gloss=0.35)


def soap_dish(
    *, size_m: tuple[float, float, float], wall_m: float, color: Color, groove: Color, seed: int
) -> Shape:
    """Shape a shallow oval dish with drain grooves in its floor."""
    rng = np.random.default_rng(seed)
    half, height = size_m[0] / 2, size_m[2]
    outline = circle(80, 3.0, size_m[1] / size_m[0])
    floor = 1.3 * wall_m
    outer = np.array([(0.80 * half, 0.0), (0.93 * half, 0.45 * height), (half, height)])
    inner = np.array(
        [(0.72 * half, floor), (0.93 * half - wall_m, 0.45 * height), (half - wall_m, height)]
    )
    profile = np.concatenate(
        [
            [(0.0, 0.0)],
            outer,
            inner[::-1],
            [(0.35 * half, floor), (0.0, floor)],
        ]
    )
    u, v = grid((192, 192))
    steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    floor_v = 1 - steps[-2:].sum() / steps.sum()
    image = np.asarray(color, float) + 5 * noise(rng, u.shape, (6, 6), 3)[..., None]
    reach = np.clip((1 - v) / (1 - floor_v), 0, 1)
    across = reach * np.cos(2 * np.pi * u)
    stripes = (np.abs(((across * 5) % 1) - 0.5) < 0.16) & (v > floor_v) & (reach < 0.93)
    image = lay(image, groove, stripes.astype(float))
    sector = circle(12, 3.0, size_m[1] / size_m[0])
    parts = collision.vessel(outer[[0, 2]], inner[[0, 2]], section=sector)
    surface = revolve(profile, section=outline)
    return Shape(solids=[Solid.of(surface, as_image(image))], collision=parts, gloss=0.5)


def computer_mouse(*, length_m: float, color: Color, wheel: Color) -> Shape:
    """Shape a computer mouse: arched shell, two buttons, wheel."""
    half = length_m / 2
    width, height = 0.29 * length_m, 0.36 * length_m
    outline = circle(72, 2.6, width / half)
    share = np.array([0.0, 0.94, 1.0, 0.995, 0.95, 0.85, 0.70, 0.50, 0.27, 0.0])
    level = np.array([0.0, 0.0, 0.04, 0.22, 0.42, 0.62, 0.79, 0.91, 0.98, 1.0])
    rings = np.empty((len(share), 72, 3))
    rings[..., :2] = half * share[:, None, None] * outline
    # Higher behind the middle than at the buttons, which point towards +x.
    slope = 1 - 0.22 * (rings[..., 0] / half + 0.25) ** 2 - 0.10 * rings[..., 0] / half
    rings[..., 2] = height * level[:, None] * slope
    shell = skin(rings).planar_uv()
    poster = Poster(color, (144, 240))
    seam: Color = (96, 98, 102)
    poster.rectangle((0.58, 0.49, 1, 0.51), seam).rectangle((0.57, 0.06, 0.58, 0.94), seam)
    poster.rectangle((0.70, 0.42, 0.90, 0.58), (60, 62, 66), radius=0.04)
    poster.ellipse((0.20, 0.42, 0.30, 0.58), (176, 178, 184))
    spin = sweep(np.array([(0, -0.0035, 0), (0, 0.0035, 0)]), 0.011, num_columns=24, up=(0, 0, 1))
    middle = (0.30 * length_m, 0.0, 0.70 * height - 0.004)
    solids = [Solid.of(shell, poster.image()), Solid.of(spin.moved(middle), plain(wheel))]
    few = np.arange(0, 72, 9)
    hull = rings[np.array([1, 3, 5, 7])][:, few].reshape(-1, 3)
    return Shape(solids=solids, collision=[collision.convex(hull)], gloss=0.4)


def remote_control(*, size_m: tuple[float, float, float], color: Color, seed: int) -> Shape:
    """Shape a remote control lying on its back: rows of keys, red power key, ring of arrows."""
    height = size_m[2]
    rng = np.random.default_rng(seed)
    poster = Poster(color, (96, 336))
    poster.ellipse((0.035, 0.16, 0.085, 0.34), (214, 40, 40))
    poster.ellipse((0.30, 0.14, 0.51, 0.86), (96, 98, 106)).ellipse((0.35, 0.32, 0.46, 0.68), color)
    key: Color = (206, 208, 212)
    for column in range(4):
        for row in range(3):
            x, y = 0.56 + 0.085 * column, 0.14 + 0.27 * row
            poster.rectangle((x, y, x + 0.055, y + 0.17), key, radius=0.01)
    key_colors: list[Color] = [(206, 52, 48), (70, 160, 72), (232, 196, 50), (58, 96, 190)]
    for row, key_color in enumerate(key_colors):
        poster.rectangle(
            (0.14, 0.10 + 0.21 * row, 0.18, 0.25 + 0.21 * row), key_color, radius=0.005
        )
        poster.rectangle((0.21, 0.10 + 0.21 * row, 0.26, 0.25 + 0.21 * row), key, radius=0.01)
    face = poster.words("TV", (0.905, 0.3, 0.985, 0.7), key).image()
    rest = mottled(rng, color, (52, 52, 56), (32, 64))
    images = [rest, rest, rest, rest, face, rest]
    panels = tuple(
        Panel(surface=s.moved((0, 0, height / 2)), image=i)
        for s, i in zip(rounded_box(size_m, 0.30 * height), images, strict=True)
    )
    parts = [collision.box(size_m, (0, 0, height / 2))]
    return Shape(solids=[Solid(panels=panels)], collision=parts, gloss=0.3)


def tape_roll(
    *, outer_m: float, inner_m: float, width_m: float, tape: Color, core: Color, seed: int
) -> Shape:
    """Shape a roll of tape lying flat: card core, wound tape, open hole."""
    rng = np.random.default_rng(seed)
    outside, hole, card = outer_m / 2, inner_m / 2, 0.003
    profile = np.array(
        [
            (hole, 0.0),
            (hole + card, 0.0),
            (outside - 0.0004, 0.0),
            (outside, 0.0006),
            (outside, width_m - 0.0006),
            (outside - 0.0004, width_m),
            (hole + card, width_m),
            (hole, width_m),
        ]
    )
    closed = np.concatenate([profile, profile[:1]])
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    surface = revolve(profile, num_columns=72, loop=True)
    u, v = grid((256, 128))
    image = np.asarray(tape, float) + 10 * noise(rng, u.shape, (64, 2), 2)[..., None]
    layers = ((v > along[1]) & (v < along[2])) | ((v > along[5]) & (v < along[6]))
    winding = 0.5 + 0.5 * np.sin(v * 900)
    image = lay(image, np.asarray(tape) * 0.72, layers * winding * 0.7)
    card_area = (v < along[1]) | (v > along[6])
    image = lay(image, core, card_area.astype(float))
    parts = _ring_of_boxes(outside, hole, width_m)
    return Shape(
        solids=[Solid.of(surface, as_image(image))], collision=parts, rolls=True, gloss=0.4
    )


def _ring_of_boxes(
    outside: float, hole: float, height: float, num_sectors: int = 12
) -> list[collision.CollisionPart]:
    """Return wedges that cover a flat ring and leave its hole open."""
    angle = np.arange(num_sectors) * (2 * np.pi / num_sectors)
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    grow = 2 / (1 + np.cos(np.pi / num_sectors))
    parts = []
    for sector in range(num_sectors):
        pair = direction[[sector, (sector + 1) % num_sectors]] * grow
        outline = np.concatenate([pair * hole, pair[::-1] * outside])
        parts.append(collision.prism(outline, 0.0, height))
    return parts


def marker(*, diameter_m: float, length_m: float, color: Color, words: str) -> Shape:
    """Shape a felt marker lying on its side: white barrel, coloured cap with clip, coloured end."""
    radius = diameter_m / 2
    heights = np.array([0, 0.0, 0.02, 0.10, 0.101, 0.30, 0.50, 0.62, 0.621, 0.64, 0.95, 1.0, 1.0])
    shares = np.array([0, 0.7, 0.86, 0.86, 0.92, 0.92, 0.92, 0.92, 1.0, 1.0, 1.0, 0.82, 0])
    profile = np.stack([shares * radius, heights * length_m], axis=1)
    surface = revolve(profile, num_columns=44, v=heights)
    poster = Poster(WHITE, (320, 96)).rectangle((0, 0, 1, 0.38), color)
    poster.rectangle((0, 0.90, 1, 1), color).rectangle((0, 0.80, 1, 0.82), color)
    for left in (0.0, 0.5):
        poster.words(words, (left + 0.1, 0.42, left + 0.4, 0.79), BLACK, turn_deg=90)
    clip_path = np.array([(1.0, 0, 0.97), (1.22, 0, 0.96), (1.25, 0, 0.75), (1.12, 0, 0.70)])
    clip_path = clip_path * [radius, 1, length_m]
    clip = sweep(
        clip_path,
        np.array([[0.0022, 0.0011]] * 4),
        num_columns=10,
        up=(0, 1, 0),
    )
    lying = Rotation.from_euler("zy", [180, 90], degrees=True)
    solids = [
        Solid.of(surface.moved(rotation=lying), poster.image()),
        Solid.of(clip.moved(rotation=lying), plain(color)),
    ]
    parts = [
        collision.rod(0.92 * radius, (0, 0, 0), (0, 0, 0.62 * length_m)),
        collision.rod(radius, (0, 0, 0.62 * length_m), (0, 0, length_m)),
        collision.capsule(
            0.0016, clip_path[1] * [radius, 1, length_m], clip_path[2] * [radius, 1, length_m]
        ),
    ]
    return Shape(
        solids=solids,
        collision=[part.moved(rotation=lying) for part in parts],
        rolls=True,
        gloss=0.4,
    )
