"""Four-legged toy animals, moulded in plastic."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.collision import CollisionPart
from models.objects.families.ornaments import Ornament, ornament
from models.objects.paint import Color, as_image, grid, lay, noise, plain, shade
from models.objects.surface import Surface, circle, ellipsoid, revolve, sweep

_COAT_PX = (96, 160)
_EYE: Color = (24, 22, 22)


@dataclass(frozen=True, kw_only=True)
class Animal:
    """Proportions of a four-legged animal; lengths in fractions of the body's length.

    Attributes:
        body_m: Length of the trunk, metres.
        girth: Half height of the trunk.
        leg: Length of the legs below the trunk's middle.
        leg_radius: Radius of a leg.
        neck: Forward and upward reach from the shoulder to the head.
        neck_radius: Radius of the neck.
        head: Half axes of the head.
        snout: Length of the muzzle.
        muzzle: Half width of the muzzle in half widths of the head.
        nose: Width of the nose in the same measure.
        ear: Radius of the ears.
        tail: Length of the tail.
    """

    body_m: float
    girth: float = 0.24
    leg: float = 0.52
    leg_radius: float = 0.085
    neck: tuple[float, float] = (0.16, 0.28)
    neck_radius: float = 0.13
    head: tuple[float, float, float] = (0.17, 0.13, 0.14)
    snout: float = 0.13
    muzzle: float = 0.62
    nose: float = 0.3
    ear: float = 0.06
    tail: float = 0.42


def quadruped(
    *,
    animal: Animal,
    coat: Color,
    marks: Color,
    pattern: Literal["plain", "spots", "stripes", "patches"] = "plain",
    crest: Literal["none", "mane", "ridge"] = "none",
    crest_color: Color = (120, 70, 30),
    trunk: bool = False,
    extra: Ornament = "none",
    extra_color: Color = (226, 214, 186),
    nose_color: Color = _EYE,
    seed: int,
) -> Shape:
    """Shape a standing animal that looks towards +x.

    Args:
        animal: Proportions.
        coat: Colour of the fur.
        marks: Colour of spots, stripes, hooves and tail tip.
        pattern: Marks on the coat.
        crest: A lion's mane, a zebra's ridge, or nothing.
        crest_color: Colour of the crest.
        trunk: Give it an elephant's trunk, tusks and large ears.
        extra: Humps, horns, antlers or plates.
        extra_color: Their colour.
        nose_color: Colour of the nose.
        seed: Varies the marks.
    """
    rng = np.random.default_rng(seed)
    unit = animal.body_m
    fur = _coat(rng, coat, marks, pattern)
    height = animal.leg * unit
    trunk_half = np.array([0.5, 0.72 * animal.girth, animal.girth]) * unit
    solids = [Solid.of(ellipsoid(trunk_half).moved((0, 0, height)), fur)]
    parts = [collision.ellipsoid(trunk_half, (0, 0, height))]
    legs, leg_parts = _legs(animal, trunk_half, height, fur, marks)
    shoulder = np.array([0.33 * unit, 0, height + 0.35 * animal.girth * unit])
    head = shoulder + np.array([animal.neck[0], 0, animal.neck[1]]) * unit
    radius = animal.neck_radius * unit
    neck_path = np.linspace(_beside(shoulder, -0.06 * unit, 0, -0.03 * unit), head, 6)
    solids += [*legs, _neck(neck_path, radius, fur)]
    parts += [*leg_parts, collision.capsule(0.95 * radius, neck_path[0], head)]
    solids += _head(animal, head, fur, coat, None if trunk else nose_color)
    head_half = np.array(animal.head) * unit
    parts.append(collision.ellipsoid(head_half, head))
    if not trunk:
        nose = _beside(head, head_half[0] + 0.45 * animal.snout * unit, 0, -0.25 * head_half[2])
        parts.append(collision.capsule(0.5 * head_half[2], head, nose))
    else:
        more, more_parts = _elephant_parts(animal, head, fur, coat)
        solids += more
        parts += more_parts
    solids += _tail(animal, height, coat, marks)
    if crest == "mane":
        solids.append(Solid.of(_mane(head, head_half), _mane_image(rng, crest_color)))
        parts.append(_mane_part(head, head_half))
    if crest == "ridge":
        solids.append(_ridge(neck_path, radius, crest_color))
    more, more_parts = ornament(
        extra,
        unit=unit,
        back=_beside(np.zeros(3), 0, 0, height + 0.92 * trunk_half[2]),
        head=head,
        head_half=head_half,
        fur=fur,
        color=extra_color,
    )
    return Shape(solids=[*solids, *more], collision=[*parts, *more_parts], gloss=0.2)


def _coat(rng: np.random.Generator, coat: Color, marks: Color, pattern: str) -> np.ndarray:
    """Paint fur."""
    u, v = grid(_COAT_PX)
    image = np.asarray(coat, float) + 9 * noise(rng, _COAT_PX, (8, 12), 3)[..., None]
    wander = noise(rng, _COAT_PX, (4, 6), 3)
    if pattern == "spots":
        cells = 0.5 * (1 - np.cos(2 * np.pi * (7 * u + 0.5 * wander))) * 0.5
        cells = cells * (1 - np.cos(2 * np.pi * (6 * v + 0.6 * wander)))
        image = lay(image, marks, np.clip((cells - 0.30) * 8, 0, 1))
    if pattern == "patches":
        image = lay(image, marks, np.clip((wander - 0.12) * 14, 0, 1))
    if pattern == "stripes":
        wave = np.sin(2 * np.pi * (7 * u + 0.35 * wander))
        image = lay(image, marks, np.clip(wave * 5, 0, 1))
    return as_image(image)


def _neck(path: np.ndarray, radius: float, fur: np.ndarray) -> Solid:
    """Build a neck that is thick at the shoulder."""
    radii = np.linspace(1.35, 0.85, len(path)) * radius
    flattened = np.stack([radii * 0.8, radii], axis=1)
    return Solid.of(sweep(path, flattened, num_columns=14, up=(1, 0, 0)), fur)


def _ridge(neck_path: np.ndarray, radius: float, color: Color) -> Solid:
    """Build the standing hair along the back of a neck."""
    path = _beside(neck_path, -1.0 * radius, 0, 0.35 * radius)
    radii = np.array([[0.16 * radius, 0.55 * radius]] * len(path))
    return Solid.of(sweep(path, radii, num_columns=10, up=(1, 0, 0)), plain(color))


def _beside(origin: np.ndarray, x: float, y: float, z: float) -> np.ndarray:
    """Shift a point, or a row of points."""
    return origin + np.array([x, y, z])


def _legs(
    animal: Animal, trunk_half: np.ndarray, height: float, fur: np.ndarray, hoof: Color
) -> tuple[list[Solid], list[CollisionPart]]:
    """Build four legs that end flat on the ground."""
    unit = animal.body_m
    radius = animal.leg_radius * unit
    solids, parts = [], []
    for x in (-0.32 * unit, 0.30 * unit):
        for side in (-1, 1):
            y = side * (trunk_half[1] - 0.75 * radius)
            profile = [
                (0, 0),
                (1.08 * radius, 0),
                (1.12 * radius, 0.04 * unit),
                (0.9 * radius, 0.08 * unit),
            ]
            profile += [(0.92 * radius, 0.5 * height), (1.25 * radius, 0.95 * height), (0, height)]
            levels = np.array([z for _, z in profile]) / height
            leg = revolve(profile, num_columns=16, v=levels)
            solids.append(Solid.of(leg.moved((x, y, 0)), fur))
            toe = revolve(
                [(0, 0.0), (1.13 * radius, 0.0), (1.15 * radius, 0.035 * unit), (0, 0.035 * unit)],
                num_columns=16,
            )
            solids.append(Solid.of(toe.moved((x, y, 0.0)), plain(hoof)))
            leg_part = collision.cylinder(radius, 0.0, height)
            parts.append(leg_part.moved((x, y, 0)))
    return solids, parts


def _head(
    animal: Animal, head: np.ndarray, fur: np.ndarray, coat: Color, nose_color: Color | None
) -> list[Solid]:
    """Build skull and eyes; where the nose has a colour, also muzzle and ears."""
    unit = animal.body_m
    half = np.array(animal.head) * unit
    solids = [Solid.of(ellipsoid(half, num_rings=13, num_columns=20).moved(head), plain(coat))]
    if nose_color is not None:
        solids += _muzzle(animal, head, half, coat, nose_color)
    for side in (-1, 1):
        eye = ellipsoid([0.14 * half[2] + 0.0006] * 3, num_rings=7, num_columns=10)
        place = _beside(head, 0.55 * half[0], side * 0.75 * half[1], 0.35 * half[2])
        solids.append(Solid.of(eye.moved(place), plain(_EYE)))
        if nose_color is not None:
            size = np.array([0.5, 0.8, 1.2]) * animal.ear * unit
            ear = ellipsoid(size, num_rings=9, num_columns=12)
            spot = _beside(head, -0.35 * half[0], side * 0.75 * half[1], 0.95 * half[2])
            solids.append(Solid.of(ear.moved(spot), fur))
    return solids


def _muzzle(
    animal: Animal, head: np.ndarray, half: np.ndarray, coat: Color, nose_color: Color
) -> list[Solid]:
    """Build a muzzle and the nose at its end."""
    reach, wide, nose = animal.snout * animal.body_m, animal.muzzle, animal.nose
    size = (reach, wide * half[1], 0.94 * wide * half[2])
    muzzle = ellipsoid(size, num_rings=11, num_columns=16)
    place = _beside(head, 0.85 * half[0], 0, -0.25 * half[2])
    tip_size = (0.3 * reach, nose * half[1], 0.73 * nose * half[2])
    tip = ellipsoid(tip_size, num_rings=9, num_columns=12)
    tip_at = _beside(place, 0.85 * reach, 0, 0.2 * half[2])
    return [
        Solid.of(muzzle.moved(place), plain(shade(coat, 1.12, 18))),
        Solid.of(tip.moved(tip_at), plain(nose_color)),
    ]


def _elephant_parts(
    animal: Animal, head: np.ndarray, fur: np.ndarray, coat: Color
) -> tuple[list[Solid], list[CollisionPart]]:
    """Build trunk, tusks and large ears."""
    unit = animal.body_m
    half = np.array(animal.head) * unit
    t = np.linspace(0, 1, 12)
    x = head[0] + half[0] * 0.6 + unit * (0.22 * np.sin(2.0 * t) + 0.06 * np.clip(t - 0.75, 0, 1))
    z = head[2] - 0.1 * half[2] - unit * (0.55 * t - 0.10 * np.clip(t - 0.8, 0, 1) * 5 * t)
    path = np.stack([x, 0 * x, z], axis=1)
    radii = unit * np.linspace(0.095, 0.045, 12)
    nose = sweep(path, np.stack([radii, radii], 1), num_columns=14, up=(0, 1, 0))
    solids = [Solid.of(nose, fur)]
    parts = collision.capsule_chain(0.06 * unit, path[[0, 4, 8, 11]])
    inner = shade(coat, 1.05, 16)
    for side in (-1, 1):
        tusk_t = np.linspace(0, 1, 6)
        tusk = head + np.stack(
            [
                half[0] * 0.7 + 0.24 * unit * tusk_t,
                side * (0.55 * half[1] + 0 * tusk_t),
                -0.55 * half[2] + unit * (-0.10 * tusk_t + 0.10 * tusk_t**2),
            ],
            axis=1,
        )
        tusk_radii = 0.032 * unit * (1.05 - tusk_t)
        ivory = sweep(tusk, np.stack([tusk_radii, tusk_radii], 1), num_columns=10, up=(0, 1, 0))
        solids.append(Solid.of(ivory, plain((244, 236, 212))))
        flap = ellipsoid((0.045 * unit, 0.15 * unit, 0.24 * unit), num_rings=13, num_columns=20)
        spot = _beside(head, -0.30 * half[0], side * (half[1] + 0.08 * unit), 0.05 * unit)
        solids.append(Solid.of(flap.moved(spot), plain(inner)))
        parts.append(collision.ellipsoid((0.045 * unit, 0.15 * unit, 0.24 * unit), spot))
    return solids, parts


def _tail(animal: Animal, height: float, coat: Color, tip: Color) -> list[Solid]:
    """Build a hanging tail with a tuft."""
    unit = animal.body_m
    t = np.linspace(0, 1, 7)
    path = np.stack(
        [
            -unit * (0.47 + 0.10 * np.sin(2.4 * t)),
            0 * t,
            height + unit * (0.10 - animal.tail * t),
        ],
        axis=1,
    )
    cord = sweep(path, np.full((7, 2), 0.028 * unit), num_columns=9, up=(0, 1, 0))
    tuft = ellipsoid((0.045 * unit, 0.045 * unit, 0.075 * unit), num_rings=9, num_columns=10)
    return [Solid.of(cord, plain(coat)), Solid.of(tuft.moved(path[-1]), plain(tip))]


def _mane(head: np.ndarray, half: np.ndarray) -> Surface:
    """Build a shaggy disc around the face."""
    angle = np.arange(60) * (2 * np.pi / 60)
    shag = 1 + 0.07 * np.cos(12 * angle)
    outline = circle(60) * shag[:, None]
    across = np.array([-0.75, -0.6, -0.1, 0.30, 0.38]) * half[0]
    share = np.array([1.15, 1.55, 1.95, 1.75, 1.25])
    path = head + np.stack([across, 0 * across, 0 * across - 0.1 * half[2]], axis=1)
    return sweep(path, np.stack([share * half[1], share * half[2]], 1), section=outline)


def _mane_part(head: np.ndarray, half: np.ndarray) -> CollisionPart:
    """Cover the mane with a short rod."""
    middle = head - [0, 0, 0.1 * half[2]]
    reach = [0.55 * half[0], 0, 0]
    return collision.rod(
        1.75 * float(half[2]), middle - reach, _beside(middle, 0.25 * half[0], 0, 0)
    )


def _mane_image(rng: np.random.Generator, color: Color) -> np.ndarray:
    """Paint strands of hair."""
    strands = noise(rng, (48, 160), (3, 60), 2)
    return as_image(np.asarray(color, float) + 34 * strands[..., None])
