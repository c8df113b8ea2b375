"""Hand tools of the workshop: wrench, pliers, claw hammer, padlock."""

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid, box_solid
from models.objects.collision import CollisionPart
from models.objects.paint import Color, Poster, brushed_metal, mottled, plain, shade
from models.objects.surface import circle, plate, refined, revolve, sweep


def wrench(*, length_m: float, head_m: float, thickness_m: float, grip: Color, seed: int) -> Shape:
    """Shape an adjustable wrench lying flat, jaws towards +x; `head_m` is the head's width."""
    rng = np.random.default_rng(seed)
    metal = brushed_metal(rng, (168, 172, 180))
    half, neck = thickness_m / 2, length_m - 1.05 * head_m
    x = np.linspace(0, neck + 0.004, 10)
    wide = np.interp(x / neck, [0, 0.06, 0.5, 1], [0.20, 0.27, 0.22, 0.24]) * head_m
    path = np.stack([x, 0 * x, 0 * x + half], axis=1)
    thick = np.interp(x / neck, [0, 0.8, 1], [0.95, 0.8, 0.75]) * half
    handle = sweep(path, np.stack([wide, thick], 1), section=circle(24, 4.0))
    coat = Poster(grip, (96, 64)).rectangle((0, 0.0, 1, 0.24), (168, 172, 180))
    coat.rectangle((0, 0.90, 1, 0.94), shade(grip, 0.6)).rectangle((0.1, 0.3, 0.4, 0.86), grip)
    body = np.array([(-0.50, -0.42), (-0.10, -0.52), (0.12, -0.44), (0.16, 0.10), (0.10, 0.50)])
    body = np.concatenate([body, [(-0.20, 0.52), (-0.50, 0.34)]]) * head_m
    fixed = np.array([(-0.05, 0.12), (0.55, 0.10), (0.62, 0.30), (0.30, 0.52), (-0.05, 0.52)])
    loose = np.array([(-0.05, -0.52), (0.35, -0.48), (0.58, -0.30), (0.55, -0.14), (-0.05, -0.14)])
    center = np.array([neck + 0.42 * head_m, 0, 0])
    solids, parts = [Solid.of(handle, coat.image())], []
    for outline, share in ((body, 1.0), (fixed * head_m, 1.0), (loose * head_m, 0.86)):
        deep = share * thickness_m
        sheet = plate(refined(outline, 0.003), deep, bevel_m=0.1 * deep, base_m=half - deep / 2)
        solids.append(Solid.of(sheet.moved(center), metal))
        parts.append(collision.prism(outline, half - deep / 2, half + deep / 2).moved(center))
    worm_at = center + np.array([-0.16 * head_m, -0.20 * head_m, half])
    worm_path = worm_at + np.array([[-1, 0, 0], [1, 0, 0]]) * 0.13 * head_m
    ribs = Poster((120, 124, 132), (64, 16))
    for rib in range(6):
        ribs.rectangle((0, rib / 6, 1, (rib + 0.5) / 6), (70, 72, 80))
    worm = sweep(worm_path, 1.06 * half, num_columns=20)
    solids.append(Solid.of(worm, ribs.image()))
    parts.append(collision.box((neck, 0.48 * head_m, 1.7 * half), (neck / 2, 0, half)))
    return Shape(solids=solids, collision=parts, gloss=0.7)


def pliers(*, length_m: float, width_m: float, grip: Color, seed: int) -> Shape:
    """Shape pliers lying flat, slightly open, jaws towards +x; `width_m` is across the handles."""
    metal = brushed_metal(np.random.default_rng(seed), (150, 154, 162))
    half = 0.0075
    solids: list[Solid] = []
    parts: list[CollisionPart] = []
    for side in (-1, 1):
        spine = np.array([(0, 0.42), (0.12, 0.50), (0.32, 0.44), (0.52, 0.22), (0.64, 0.04)]) * [
            length_m,
            side * width_m,
        ]
        share = np.linspace(0, 4, 17)
        path = np.stack(
            [*(np.interp(share, range(5), column) for column in spine.T), 0 * share + half], axis=1
        )
        sizes = (
            np.array([[0.0062, half]] * 17) * np.interp(share, [0, 0.5, 4], [0.75, 1, 0.9])[:, None]
        )
        solids.append(Solid.of(sweep(path, sizes, section=circle(20, 3.0)), plain(grip)))
        # Each jaw belongs to the handle of the other side.
        jaw = np.array([(0.62, 0.15), (0.66, 0.025), (0.74, -0.02), (1.0, -0.03), (1.0, -0.07)])
        jaw = np.concatenate([jaw, [(0.86, -0.20), (0.74, -0.26), (0.64, -0.22)]])
        outline = jaw * [length_m, side * width_m]
        if side > 0:
            outline = outline[::-1]
        sheet = plate(refined(outline, 0.003), 1.7 * half, bevel_m=0.0012, base_m=0.15 * half)
        solids.append(Solid.of(sheet, metal))
        parts.append(collision.prism(outline, 0.15 * half, 1.85 * half))
        parts += collision.capsule_chain(0.0066, path[[1, 8, 16]] - [0, 0, 0.0009])
    pivot = revolve(
        [(0, 0.0004), (0.30 * width_m, 0.0004), (0.30 * width_m, 1.9 * half), (0, 1.9 * half)]
    )
    screw = revolve(
        [(0, half), (0.13 * width_m, half), (0.12 * width_m, 2.1 * half), (0, 2.1 * half)]
    )
    for surface, image in ((pivot, metal), (screw, plain((96, 98, 106)))):
        solids.append(Solid.of(surface.moved((0.66 * length_m, 0, 0)), image))
    return Shape(solids=solids, collision=parts, gloss=0.6)


def claw_hammer(*, length_m: float, head_m: float, grip: Color, shaft: Color, seed: int) -> Shape:
    """Shape a claw hammer lying on its side; `head_m` runs from the face to the claw's tip."""
    metal = brushed_metal(np.random.default_rng(seed), (142, 146, 154))
    half = 0.0135
    head_x = length_m - 0.017
    x = np.linspace(0, head_x + 0.010, 12)
    wide = np.interp(x / length_m, [0, 0.05, 0.3, 0.5, 1], [0.015, 0.018, 0.016, 0.012, 0.012])
    thick = np.interp(x / length_m, [0, 0.05, 0.3, 0.5, 1], [0.8, 1.0, 0.95, 0.75, 0.75]) * half
    path = np.stack([x, 0 * x, 0 * x + half], axis=1)
    handle = sweep(path, np.stack([wide, thick], 1), section=circle(24, 2.6))
    coat = Poster(shaft, (160, 32)).rectangle((0, 0.52, 1, 1), grip)
    for ring in range(6):
        coat.rectangle((0, 0.58 + 0.06 * ring, 1, 0.60 + 0.06 * ring), shade(grip, 0.6))
    y = np.array([-0.50, -0.49, -0.34, -0.33, -0.20, 0.02]) * head_m
    size = np.array([0.92, 1.0, 1.0, 0.72, 0.72, 0.90]) * half
    poll = np.stack([0 * y + head_x, y, 0 * y + half], axis=1)
    solids = [
        Solid.of(handle, coat.image()),
        Solid.of(sweep(poll, np.stack([size, size], 1), num_columns=28), metal),
        box_solid((0.032, 0.030, 2 * half), 0.003, metal, (head_x, 0.02 * head_m, half)),
    ]
    t = np.linspace(0, 1, 8)
    for side in (-1, 1):
        prong = np.stack(
            [
                head_x + 0.004 - 0.030 * t**2,
                head_m * (0.06 + 0.44 * t),
                half + side * half * (0.35 + 0.25 * t),
            ],
            axis=1,
        )
        flat = np.stack([np.linspace(0.010, 0.002, 8), np.linspace(0.006, 0.004, 8)], axis=1)
        solids.append(Solid.of(sweep(prong, flat, section=circle(16, 4.0)), metal))
    claw = [(0.012, 0.06), (-0.008, 0.06), (-0.022, 0.48), (-0.026, 0.50), (0.0, 0.36)]
    outline = np.array([(head_x + a, b * head_m) for a, b in claw])
    parts = [
        collision.rod(half, poll[0], poll[2]),
        collision.box((0.032, 0.42 * head_m, 2 * half), (head_x, -0.13 * head_m, half)),
        collision.prism(outline, 0.25 * half, 1.75 * half),
        collision.box((0.45 * length_m, 0.031, 1.9 * half), (0.225 * length_m, 0, half)),
        collision.box((0.55 * length_m, 0.022, 1.4 * half), (0.70 * length_m, 0, half)),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.5)


def padlock(
    *, body_m: tuple[float, float, float], shackle_m: float, color: Color, words: str, seed: int
) -> Shape:
    """Shape a padlock lying flat; its shackle, `shackle_m` high, points towards +y.

    Args:
        body_m: Width, height and thickness of the body.
        shackle_m: How far the shackle stands out.
        color: Colour of the body.
        words: Stamped on the front.
        seed: Varies the metal.
    """
    rng = np.random.default_rng(seed)
    width, height, thick = body_m
    face = Poster(color, (112, 128)).words(words, (0.15, 0.14, 0.85, 0.46), shade(color, 0.5))
    face.ellipse((0.42, 0.56, 0.58, 0.76), shade(color, 0.4))
    face.rectangle((0.46, 0.66, 0.54, 0.88), shade(color, 0.4))
    rest = mottled(rng, color, shade(color, 0.9), (48, 48))
    images = [rest, rest, rest, rest, face.image(), face.image()]
    radius = 0.11 * width
    bow = 0.5 * width - 1.6 * radius
    turn = np.linspace(0, np.pi, 13)
    rise = shackle_m - bow - radius
    arc = np.stack([bow * np.cos(turn), height / 2 + rise + bow * np.sin(turn)], axis=1)
    legs = [[(bow, 0.3 * height)], arc, [(-bow, 0.3 * height)]]
    flat = np.concatenate(legs)
    path = np.column_stack([flat, np.full(len(flat), thick / 2)])
    shackle = sweep(path, radius, num_columns=18)
    solids = [
        box_solid(body_m, 0.16 * thick, images, (0, 0, thick / 2)),
        Solid.of(shackle, brushed_metal(rng, (196, 200, 206))),
    ]
    parts = [
        collision.box(body_m, (0, 0, thick / 2)),
        *collision.capsule_chain(radius, path[[0, 1, 4, 7, 10, 13, 14]]),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.7)
