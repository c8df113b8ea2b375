"""Toy vehicles: cars, buses and trucks, boats, locomotives. They look towards +x."""

from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid, box_solid
from models.objects.collision import CollisionPart
from models.objects.paint import STEEL, WHITE, Color, Poster, mottled, plain, shade
from models.objects.surface import circle, plate, refined, revolve, skin, sweep

_GLASS: Color = (86, 126, 158)
_TYRE: Color = (38, 38, 42)
_UPRIGHT = Rotation.from_euler("x", 90, degrees=True)

# Side views in fractions of length and height, counter-clockwise from the rear bumper.
_SIDES: dict[str, list[tuple[float, float]]] = {
    "car": [
        (0, 0),
        (1, 0),
        (1, 0.42),
        (0.97, 0.50),
        (0.76, 0.56),
        (0.62, 0.98),
        (0.55, 1),
        (0.25, 1),
        (0.18, 0.97),
        (0.06, 0.60),
        (0, 0.52),
    ],
    "bus": [(0, 0), (1, 0), (1, 0.50), (0.96, 0.92), (0.92, 1), (0.03, 1), (0, 0.95)],
}


def car(
    *,
    kind: Literal["car", "bus"],
    size_m: tuple[float, float, float],
    color: Color,
    stripe: Color,
    words: str,
    seed: int,
) -> Shape:
    """Shape a road vehicle on four wheels.

    Args:
        kind: Which side view.
        size_m: Length, width and height with wheels.
        color: Colour of the body.
        stripe: Colour of the band along the doors.
        words: Printed on the flanks.
        seed: Varies the paint.
    """
    length, width, height = size_m
    wheel = (0.30 if kind == "car" else 0.22) * height
    sill = 0.65 * wheel
    outline = np.array(_SIDES[kind]) * [length, height - sill] - [length / 2, 0]
    dense = refined(outline, 0.004)
    shell = plate(dense, width, bevel_m=0.06 * width, base_m=-width / 2)
    image = _flank(kind, color, stripe, words)
    body = Solid.of(shell.moved((0, 0, sill), _UPRIGHT), image)
    axles = (-0.28 * length, 0.28 * length)
    solids, parts = [body], []
    for x in axles:
        more, part = _axle(x, wheel, width)
        solids += more
        parts.append(part)
    for side in (-1, 1):
        lamp = box_solid((0.006, 0.22 * width, 0.07 * height), 0.001, plain((250, 240, 190)))
        z = sill + 0.33 * (height - sill)
        solids.append(_shifted(lamp, (0.5 * length, side * 0.30 * width, z)))
    lower = 0.5 * (height - sill)
    if kind == "car":
        parts.append(collision.box((length, width, lower), (0, 0, sill + lower / 2)))
        roof = outline[[4, 5, 8, 9]]
        corners = [(x, y, sill + z) for x, z in roof for y in (-width / 2, width / 2)]
        parts.append(collision.convex(np.array(corners)))
    else:
        parts.append(collision.box((length, width, height - sill), (0, 0, (height + sill) / 2)))
    return Shape(solids=solids, collision=parts, gloss=0.5)


def _shifted(solid: Solid, offset: tuple[float, float, float]) -> Solid:
    """Move a solid."""
    panels = tuple(replace(p, surface=p.surface.moved(offset)) for p in solid.panels)
    return Solid(panels=panels)


def _flank(kind: str, color: Color, stripe: Color, words: str) -> np.ndarray:
    """Paint a side view: windows, doors, band, words."""
    poster = Poster(color, (144, 288))
    if kind == "car":
        poster.polygon([(0.22, 0.10), (0.39, 0.10), (0.39, 0.40), (0.13, 0.40)], _GLASS)
        poster.polygon([(0.42, 0.10), (0.58, 0.10), (0.69, 0.40), (0.42, 0.40)], _GLASS)
        poster.rectangle((0.40, 0.08, 0.41, 0.85), shade(color, 0.6))
        poster.rectangle((0.02, 0.56, 0.98, 0.64), stripe)
        poster.words(words, (0.44, 0.64, 0.68, 0.90), WHITE)
    else:
        for window in range(5):
            left = 0.06 + 0.155 * window
            poster.rectangle((left, 0.14, left + 0.125, 0.46), _GLASS, radius=0.01)
        poster.rectangle((0.84, 0.14, 0.93, 0.86), _GLASS, radius=0.01)
        poster.rectangle((0.02, 0.56, 0.82, 0.64), stripe)
        poster.words(words, (0.30, 0.65, 0.62, 0.95), stripe)
    for x in (0.22, 0.78):
        poster.ellipse((x - 0.12, 0.74, x + 0.12, 1.26), shade(color, 0.35))
    return poster.image()


def _axle(x: float, radius: float, width: float) -> tuple[list[Solid], CollisionPart]:
    """Build two wheels with hubs, felt as one roller."""
    solids = []
    for side in (-1, 1):
        y = side * 0.47 * width
        half = 0.06 * width
        tread = [(0, -half), (radius - 0.001, -half), (radius, 0.6 * -half)]
        tread += [(radius, 0.6 * half), (radius - 0.001, half), (0, half)]
        tyre = revolve(tread, num_columns=28)
        hub = revolve([(0, -half), (0.5 * radius, -half), (0.5 * radius, half), (0, half)])
        solids.append(Solid.of(tyre.moved((x, y, radius), _UPRIGHT), plain(_TYRE)))
        hub_at = (x, y + side * 0.0008, radius)
        solids.append(Solid.of(hub.scaled((1, 1, 1.02)).moved(hub_at, _UPRIGHT), plain(STEEL)))
    reach = 0.53 * width
    return solids, collision.rod(radius, (x, -reach, radius), (x, reach, radius))


def boat(
    *, length_m: float, beam_m: float, hull: Color, deck: Color, cabin: Color, seed: int
) -> Shape:
    """Shape a toy boat: pointed hull, raised deck, cabin, funnel."""
    rng = np.random.default_rng(seed)
    num = 48
    height = 0.24 * length_m
    outline = circle(num, 2.4, beam_m / length_m) * (length_m / 2)
    # The bow is drawn out to a point, the stern stays blunt.
    forward = np.clip(outline[:, 0] / (length_m / 2), 0, 1)
    outline[:, 1] *= 1 - 0.75 * forward**2
    levels = [(0.0, 0.0), (0.66, 0.0), (0.80, 0.20), (0.92, 0.55), (1.0, 1.0)]
    levels += [(0.93, 1.0), (0.90, 0.86), (0.0, 0.86)]
    rings = np.stack([np.column_stack([outline * s, np.full(num, z * height)]) for s, z in levels])
    poster = Poster(hull, (96, 192)).rectangle((0, 0.0, 1, 0.42), deck)
    poster.rectangle((0, 0.56, 1, 0.62), WHITE)
    solids = [Solid.of(skin(rings), poster.image())]
    house = (0.30 * length_m, 0.52 * beam_m, 0.60 * height)
    house_z = 0.86 * height + house[2] / 2 - 0.001
    flank = Poster(cabin, (48, 96))
    for port in range(3):
        left = 0.14 + 0.26 * port
        flank.ellipse((left, 0.25, left + 0.18, 0.65), _GLASS)
    walls = mottled(rng, cabin, shade(cabin, 0.96), (32, 32))
    sides = [walls, walls, flank.image(), flank.image(), walls, walls]
    house_x = -0.10 * length_m
    solids.append(box_solid(house, 0.0015, sides, (house_x, 0, house_z)))
    low, top = house_z + house[2] / 2 - 0.001, house_z + house[2] / 2 + 0.55 * height
    funnel = 0.16 * beam_m
    pipe = revolve([(0, low), (funnel, low), (funnel, (low + top) / 2), (funnel, top), (0, top)])
    bands = Poster(hull, (48, 16)).rectangle((0, 0.2, 1, 0.55), WHITE).image()
    solids.append(Solid.of(pipe.moved((house_x, 0, 0)), bands))
    few = rings[:, ::6]
    parts = [
        collision.convex(few[[1, 2, 4]].reshape(-1, 3)),
        collision.box(house, (house_x, 0, house_z)),
        collision.cylinder(funnel, low, top).moved((house_x, 0, 0)),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.4)


def locomotive(
    *, length_m: float, width_m: float, boiler: Color, cab: Color, trim: Color, seed: int
) -> Shape:
    """Shape a toy steam locomotive: boiler, cab, funnel, three axles."""
    rng = np.random.default_rng(seed)
    wheel, radius = 0.11 * length_m, 0.36 * width_m
    floor = 1.25 * wheel
    axis = floor + radius
    frame = (length_m, 0.80 * width_m, 0.7 * wheel)
    frame_at = (0, 0, floor - 0.25 * wheel)
    solids = [box_solid(frame, 0.0015, plain(trim), frame_at)]
    rear, front = -0.16 * length_m, 0.47 * length_m
    path = np.array([(rear, 0, axis), (0, 0, axis), (front - 0.004, 0, axis), (front, 0, axis)])
    barrel = Poster(boiler, (96, 32))
    for band in (0.30, 0.55, 0.80):
        barrel.rectangle((0, band, 1, band + 0.03), (224, 190, 80))
    sizes = radius * np.array([1.0, 1.0, 1.0, 0.86])
    solids.append(Solid.of(sweep(path, sizes, num_columns=32), barrel.image()))
    house = (0.33 * length_m, width_m, 2.9 * radius)
    house_at = (-0.5 * length_m + house[0] / 2, 0, floor + house[2] / 2 - 0.001)
    flank = Poster(cab, (64, 64)).rectangle((0.22, 0.16, 0.78, 0.50), _GLASS, radius=0.06)
    rest = mottled(rng, cab, shade(cab, 0.95), (32, 32))
    sides = [rest, rest, flank.image(), flank.image(), rest, rest]
    solids.append(box_solid(house, 0.0015, sides, house_at))
    roof = (house[0] * 1.12, width_m * 1.06, 0.005)
    top = floor + house[2]
    solids.append(box_solid(roof, 0.0015, plain(trim), (house_at[0], 0, top)))
    pipe_x, pipe = 0.34 * length_m, 0.34 * radius
    funnel = revolve(
        [
            (0, axis),
            (pipe, axis),
            (pipe, axis + 1.5 * radius),
            (1.6 * pipe, top - 0.004),
            (1.6 * pipe, top),
            (0, top),
        ]
    )
    solids.append(Solid.of(funnel.moved((pipe_x, 0, 0)), plain(trim)))
    dome = revolve(
        [
            (0, axis),
            (1.2 * pipe, axis),
            (1.2 * pipe, axis + 1.15 * radius),
            (0.7 * pipe, axis + 1.4 * radius),
            (0, axis + 1.45 * radius),
        ]
    )
    solids.append(Solid.of(dome.moved((0.10 * length_m, 0, 0)), plain((224, 190, 80))))
    parts = [
        collision.box(frame, frame_at),
        collision.rod(radius, path[0], path[-1]),
        collision.box((*house[:2], house[2] + 0.003), house_at),
        collision.cylinder(1.3 * pipe, axis, top).moved((pipe_x, 0, 0)),
    ]
    for x in (-0.34, 0.0, 0.34):
        more, part = _axle(x * length_m, wheel, 0.9 * width_m)
        solids += more
        parts.append(part)
    return Shape(solids=solids, collision=parts, gloss=0.4)
