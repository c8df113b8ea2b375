"""What tells one four-legged toy animal from another: humps, horns, antlers, plates."""

from typing import Literal

import numpy as np

from models.objects import collision
from models.objects.atlas import Solid
from models.objects.collision import CollisionPart
from models.objects.paint import Color, plain
from models.objects.surface import circle, ellipsoid, plate, sweep

Ornament = Literal["none", "hump", "nose_horn", "horns", "antlers", "plates"]
Parts = tuple[list[Solid], list[CollisionPart]]


def ornament(
    kind: Ornament,
    *,
    unit: float,
    back: np.ndarray,
    head: np.ndarray,
    head_half: np.ndarray,
    fur: np.ndarray,
    color: Color,
) -> Parts:
    """Build an animal's ornament.

    Args:
        kind: Which.
        unit: Length of the trunk, metres.
        back: (3,) middle of the back, metres.
        head: (3,) centre of the head, metres.
        head_half: (3,) half axes of the head, metres.
        fur: Image of the coat.
        color: Colour of horn, antlers or plates.

    Returns:
        Solids and collision parts.
    """
    if kind == "hump":
        return _hump(unit, back, fur)
    if kind == "nose_horn":
        return _nose_horn(unit, head, head_half, color)
    if kind == "horns":
        return _pair(_horn_paths(unit), 0.045 * unit, head, head_half, color)
    if kind == "antlers":
        return _pair(_antler_paths(unit), 0.030 * unit, head, head_half, color)
    if kind == "plates":
        return _plates(unit, back, color)
    return [], []


def _hump(unit: float, back: np.ndarray, fur: np.ndarray) -> Parts:
    """Build a camel's hump."""
    half = np.array([0.22, 0.13, 0.24]) * unit
    return [Solid.of(ellipsoid(half).moved(back), fur)], [collision.ellipsoid(half, back)]


def _nose_horn(unit: float, head: np.ndarray, half: np.ndarray, color: Color) -> Parts:
    """Build a rhinoceros's large horn with a small one behind it."""
    solids, parts = [], []
    for forward, length in ((1.30, 0.30), (0.72, 0.14)):
        root = head + np.array([forward * half[0], 0, 0.0])
        t = np.linspace(0, 1, 7)[:, None]
        path = root + unit * length * np.hstack([0.35 * t**2, 0 * t, 1.25 * t])
        radii = 0.065 * unit * (length / 0.30) ** 0.5 * (1.04 - t)
        horn = sweep(path, np.hstack([radii, radii]), num_columns=14, up=(0, 1, 0))
        solids.append(Solid.of(horn, plain(color)))
        parts.append(collision.capsule(0.03 * unit, path[0], path[4]))
    return solids, parts


def _horn_paths(unit: float) -> list[np.ndarray]:
    """Return a cow's horn: out, then up."""
    t = np.linspace(0, 1, 7)
    path = np.stack([0.03 * t, 0.16 * np.sin(1.7 * t), 0.16 * t**2], axis=1)
    return [path * unit]


def _antler_paths(unit: float) -> list[np.ndarray]:
    """Return a deer's beam and two tines."""
    t = np.linspace(0, 1, 7)
    beam = np.stack([-0.16 * t + 0.10 * t**3, 0.20 * np.sin(1.6 * t), 0.50 * t], axis=1)
    tines = []
    for share in (2, 4):
        tip = beam[share] + np.array([0.13, 0.03, 0.11])
        tines.append(np.linspace(beam[share], tip, 4))
    return [path * unit for path in (beam, *tines)]


def _pair(
    paths: list[np.ndarray], radius: float, head: np.ndarray, half: np.ndarray, color: Color
) -> Parts:
    """Put the same branches on both sides of the head; the first one is felt."""
    solids, parts = [], []
    for side in (-1, 1):
        root = head + np.array([-0.2 * half[0], side * 0.5 * half[1], 0.75 * half[2]])
        for index, path in enumerate(paths):
            placed = root + path * [1, side, 1]
            taper = radius * np.linspace(1.0, 0.35, len(path))
            branch = sweep(placed, np.stack([taper, taper], 1), num_columns=10, up=(1, 0, 0))
            solids.append(Solid.of(branch, plain(color)))
            if index == 0:
                parts.append(collision.capsule(0.6 * radius, placed[0], placed[-2]))
    return solids, parts


def _plates(unit: float, back: np.ndarray, color: Color) -> Parts:
    """Build the row of plates along a stegosaur's back."""
    solids = []
    for x, size in ((-0.38, 0.10), (-0.20, 0.15), (0.0, 0.18), (0.19, 0.15), (0.35, 0.11)):
        outline = circle(24, 1.3) * size * unit * [0.85, 1.25]
        sheet = plate(outline, 0.045 * unit, bevel_m=0.012 * unit, base_m=-0.0225 * unit)
        # The outline was drawn lying down; y becomes z.
        standing = sheet.mapped(lambda p: np.stack([p[:, 0], -p[:, 2], p[:, 1]], axis=1))
        place = back + np.array([x, 0, 0.02 - 0.35 * abs(x) ** 2]) * unit
        solids.append(Solid.of(standing.moved(place), plain(color)))
    middle = back + np.array([0, 0, 0.06]) * unit
    part = collision.box(np.array([0.72, 0.045, 0.26]) * unit, middle)
    return solids, [part]
