"""Toy figures that do not stand on four legs: a bath duck, sitting apes and bears."""

import numpy as np
from numpy.typing import ArrayLike

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.collision import CollisionPart
from models.objects.paint import Color, as_image, mottled, noise, plain, shade
from models.objects.surface import Surface, circle, ellipsoid, sweep

_EYE: Color = (22, 20, 22)


def _body(half: np.ndarray, floor: float, image: np.ndarray) -> tuple[Solid, CollisionPart]:
    """Make an egg with a flat base: its centre hangs `floor` above the table, metres."""

    def flatten(points: np.ndarray) -> np.ndarray:
        return np.column_stack([points[:, :2], np.maximum(points[:, 2], -floor)])

    surface = ellipsoid(half, num_rings=21, num_columns=32).mapped(flatten)
    solid = Solid.of(surface.moved((0, 0, floor)), image)
    few = circle(10)
    layers = []
    for level in (-floor, 0.1 * half[2], 0.75 * half[2]):
        share = np.sqrt(1 - (level / half[2]) ** 2)
        ring = few * half[:2] * share
        layers.append(np.column_stack([ring, np.full(10, level + floor)]))
    return solid, collision.convex(np.concatenate(layers))


def _egg(half: ArrayLike, center: ArrayLike, color: Color) -> Solid:
    """Make a small ellipsoid of one colour."""
    return Solid.of(ellipsoid(half, num_rings=11, num_columns=18).moved(center), plain(color))


def duck(*, length_m: float, body: Color, beak: Color, seed: int) -> Shape:
    """Shape a bath duck that looks towards +x; `length_m` runs from tail to breast."""
    rng = np.random.default_rng(seed)
    skin = mottled(rng, body, shade(body, 0.97))
    half = np.array([0.50, 0.36, 0.34]) * length_m
    trunk, trunk_part = _body(half, 0.72 * half[2], skin)
    radius = 0.245 * length_m
    head = np.array([0.22, 0, 0.70]) * length_m
    bill = head + np.array([0.98 * radius, 0, -0.12 * radius])
    gap = np.array([0, 0, 0.020]) * length_m
    tail = np.array([[-0.36, 0, 0.34], [-0.50, 0, 0.42], [-0.58, 0, 0.54]]) * length_m
    taper = np.array([[0.17, 0.13], [0.11, 0.08], [0.03, 0.02]]) * length_m
    solids = [
        trunk,
        Solid.of(ellipsoid([radius] * 3).moved(head), skin),
        Solid.of(sweep(tail, taper, num_columns=18, up=(0, 1, 0)), skin),
        _egg(np.array([0.13, 0.12, 0.028]) * length_m, bill + gap, beak),
        _egg(np.array([0.10, 0.10, 0.024]) * length_m, bill - gap, beak),
    ]
    for side in (-1, 1):
        wing = np.array([-0.08, side * 0.33, 0.30]) * length_m
        solids.append(_egg(np.array([0.24, 0.06, 0.14]) * length_m, wing, shade(body, 0.94)))
        eye = head + radius * np.array([0.66, side * 0.58, 0.40])
        solids.append(_egg([0.16 * radius] * 3, eye, _EYE))
    parts = [
        trunk_part,
        collision.sphere(radius, head),
        collision.capsule(0.04 * length_m, head, bill + 3 * gap[[2, 0, 0]]),
        collision.capsule(0.05 * length_m, tail[0], tail[1]),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.5)


def sitting_animal(
    *,
    height_m: float,
    fur: Color,
    face: Color,
    ear: tuple[float, float],
    head: float = 0.27,
    tail: bool = False,
    seed: int,
) -> Shape:
    """Shape a monkey, ape or bear that sits and looks towards +x.

    Args:
        height_m: Height.
        fur: Colour of the coat.
        face: Colour of face, belly, palms and soles.
        ear: Radius of the ears and how far up the head they sit, in heads.
        head: Radius of the head in fractions of the height.
        tail: Give it a long tail.
        seed: Varies the fur.
    """
    rng = np.random.default_rng(seed)
    image = as_image(np.asarray(fur, float) + 14 * noise(rng, (96, 128), (24, 24), 2)[..., None])
    unit = height_m
    half = np.array([0.22, 0.24, 0.34]) * unit
    trunk, trunk_part = _body(half, 0.26 * unit, image)
    radius = head * unit
    at = np.array([0.03 * unit, 0, unit - radius])
    skull = np.array([0.95, 1.0, 1.0]) * radius
    solids = [
        trunk,
        _egg(np.array([0.10, 0.17, 0.21]) * unit, np.array([0.145, 0, 0.27]) * unit, face),
        Solid.of(ellipsoid(skull, num_rings=15, num_columns=24).moved(at), image),
        _egg(radius * np.array([0.45, 0.62, 0.46]), at + radius * np.array([0.68, 0, -0.26]), face),
        _egg(radius * np.array([0.10, 0.17, 0.11]), at + radius * np.array([1.10, 0, -0.10]), _EYE),
    ]
    parts = [trunk_part, collision.ellipsoid(skull, at)]
    for side in (-1, 1):
        eye = at + radius * np.array([0.82, side * 0.34, 0.30])
        solids.append(_egg([0.12 * radius] * 3, eye, _EYE))
        lobe = at + radius * np.array([-0.05, side * 0.95, ear[1]])
        size = ear[0] * radius
        solids.append(_egg(size * np.array([0.5, 1, 1]), lobe, fur))
        inner = lobe + np.array([0.32 * size, 0, 0])
        solids.append(_egg(size * np.array([0.35, 0.65, 0.65]), inner, face))
        parts.append(collision.sphere(0.75 * size, lobe))
        limbs, limb_parts = _limbs(side, unit, image, face)
        solids += limbs
        parts += limb_parts
    if tail:
        solids.append(Solid.of(_tail(unit), image))
    return Shape(solids=solids, collision=parts, gloss=0.15)


def _limbs(
    side: int, unit: float, fur: np.ndarray, palm: Color
) -> tuple[list[Solid], list[CollisionPart]]:
    """Build an arm that rests on the knee, and an outstretched leg, on one side."""
    arm = np.array([[0.0, 0.20, 0.50], [0.07, 0.29, 0.38], [0.20, 0.26, 0.27]])
    leg = np.array([[0.05, 0.17, 0.085], [0.22, 0.22, 0.085], [0.36, 0.24, 0.085]])
    solids, parts = [], []
    for path, radius in ((arm, 0.066), (leg, 0.085)):
        placed = path * [1, side, 1] * unit
        dense = np.linspace(0, 2, 9)
        smooth = np.stack([np.interp(dense, [0, 1, 2], column) for column in placed.T], axis=1)
        limb = sweep(smooth, radius * unit, num_columns=16)
        solids.append(Solid.of(limb, fur))
        tip = placed[-1]
        solids.append(_egg([radius * unit * 1.0] * 3, tip, palm))
        parts.append(collision.capsule(radius * unit, placed[0], tip))
    return solids, parts


def _tail(unit: float) -> Surface:
    """Build a tail that curls up behind."""
    t = np.linspace(0, 1, 12)
    path = np.stack([-0.18 - 0.16 * np.sin(2.6 * t), 0 * t, 0.06 + 0.36 * t**1.5], axis=1) * unit
    return sweep(path, 0.035 * unit, num_columns=12, up=(0, 1, 0))
