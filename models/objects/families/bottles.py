"""Bottles with screw, flip, pump and trigger caps, and squeeze tubes."""

import zlib
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.collision import CollisionPart
from models.objects.paint import Color, Poster, plain
from models.objects.surface import circle, revolve, skin, sweep

CapKind = Literal["screw", "flip", "pump", "trigger"]
_NUM_COLUMNS = 48
_LABEL_PX = (224, 440)


@dataclass(frozen=True, kw_only=True)
class Label:
    """What is printed around a bottle or a tube.

    Attributes:
        title: Large words, front and back; lines split at newlines.
        subtitle: Small line below.
        body: Colour of the plastic.
        paper: Colour of the label's ground.
        ink: Colour of the title.
        accent: Colour of the emblem and bands.
        span: Lowest and highest height of the label in fractions of the body's height.
        emblem: Shape printed under the title.
    """

    title: str
    subtitle: str
    body: Color
    paper: Color
    ink: Color
    accent: Color
    span: tuple[float, float] = (0.14, 0.72)
    emblem: Literal["drop", "wave", "leaf", "circle"] = "drop"

    def paint(self) -> np.ndarray:
        """Print the label around u with fronts facing -y and +y; v is the height."""
        rng = np.random.default_rng(zlib.crc32(self.title.encode()))
        top, bottom = 1 - self.span[1], 1 - self.span[0]
        tall = bottom - top
        poster = Poster(self.body, _LABEL_PX)
        for front in (0.25, 0.75):
            left, right = front - 0.19, front + 0.19
            poster.rectangle((left, top, right, bottom), self.paper, radius=0.02)
            poster.rectangle((left, top, right, top + 0.07 * tall), self.accent)
            title = (left + 0.015, top + 0.12 * tall, right - 0.015, top + 0.52 * tall)
            poster.words(self.title, title, self.ink)
            self._print_emblem(poster, (front, top + 0.68 * tall), 0.13 * tall)
            small = (left + 0.03, top + 0.85 * tall, right - 0.03, top + 0.97 * tall)
            poster.words(self.subtitle, small, self.ink)
        poster.small_print((0.945, top + 0.3 * tall, 0.985, bottom - 0.1 * tall), self.accent, 7)
        poster.barcode(rng, (0.465, top + 0.2 * tall, 0.535, top + 0.5 * tall))
        return poster.image()

    def _print_emblem(
        self, poster: Poster, center: tuple[float, float], half_height: float
    ) -> None:
        """Print the emblem about a point; the label's image is about twice as wide as high."""
        x, y = center
        h, w = half_height, half_height * 0.55
        turn = np.linspace(0, 2 * np.pi, 40)
        if self.emblem == "circle":
            poster.ellipse((x - w, y - h, x + w, y + h), self.accent)
        elif self.emblem == "drop":
            pinch = np.where(np.sin(turn) > 0, np.cos(turn) * (1 - np.sin(turn) ** 2), np.cos(turn))
            poster.polygon(
                np.stack([x + 0.8 * w * pinch, y - h * np.sin(turn)], axis=1).tolist(), self.accent
            )
        elif self.emblem == "leaf":
            points = np.stack([2 * w * np.cos(turn), h * np.sin(turn) * np.abs(np.sin(turn))], 1)
            poster.polygon((points + np.array([x, y])).tolist(), self.accent)
        else:
            along = np.linspace(-0.17, 0.17, 24)
            crest = 0.35 * h * np.sin(along * 50)
            upper = np.stack([x + along, y + crest - 0.5 * h], axis=1)
            lower = np.stack([x + along, y + crest + 0.5 * h], axis=1)[::-1]
            poster.polygon([*upper.tolist(), *lower.tolist()], self.accent)


def bottle(
    *,
    width_m: float,
    depth_m: float,
    height_m: float,
    shoulder: float,
    neck_m: float,
    cap: CapKind,
    cap_color: Color,
    label: Label,
    squareness: float = 2.0,
    waist: float = 0.0,
) -> Shape:
    """Shape a bottle that stands upright.

    Args:
        width_m: Extent along x.
        depth_m: Extent along y.
        height_m: Height with cap.
        shoulder: Height at which the body starts to narrow, in fractions of the body's height.
        neck_m: Diameter of the neck; caps are a little wider.
        cap: Kind of closure.
        cap_color: Its colour.
        label: What is printed on the body.
        squareness: Exponent of the superelliptic section, 2 for an ellipse.
        waist: How far the middle narrows, in fractions of the width.
    """
    cap_height = {"screw": 0.022, "flip": 0.030, "pump": 0.052, "trigger": 0.062}[cap]
    body_height = height_m - cap_height
    outline = circle(_NUM_COLUMNS, squareness, depth_m / width_m) * (width_m / 2)
    rings, levels = _body_rings(outline, body_height, shoulder, neck_m / 2, waist)
    body = skin(rings, v=np.concatenate([[0.0], levels, [1.0]]))
    solids = [Solid.of(body, label.paint())]
    caps, cap_parts = _cap(cap, neck_m / 2, body_height, cap_height, cap_color)
    parts = [*_body_parts(outline, body_height, shoulder, neck_m / 2, squareness), *cap_parts]
    return Shape(solids=[*solids, *caps], collision=parts, rolls=True, gloss=0.5)


def _body_rings(
    outline: np.ndarray, height: float, shoulder: float, neck: float, waist: float
) -> tuple[np.ndarray, np.ndarray]:
    """Stack the rings of a bottle's body; return them with the height fraction of each."""
    foot = [(0.0, 0.90), (0.008, 0.97), (0.025, 1.0)]
    wall = [(level, 1.0) for level in np.linspace(0.08, shoulder, 9)]
    levels = np.array([level for level, _ in foot + wall])
    scale = np.array([share for _, share in foot + wall])
    scale -= waist * np.sin(np.pi * np.clip(levels / shoulder, 0, 1)) ** 2
    rings = [
        np.column_stack([outline * k, np.full(len(outline), h * height)])
        for h, k in zip(levels, scale, strict=True)
    ]
    round_neck = circle(len(outline)) * neck
    climb = np.linspace(0, 1, 8)[1:]
    top_levels = shoulder + (1 - shoulder) * np.sin(climb * np.pi / 2) ** 0.9
    for level, share in zip(top_levels, climb, strict=True):
        # A quarter ellipse from wall to neck: first upwards, then inwards.
        weight = 1 - np.cos(share * np.pi / 2)
        ring = outline * (1 - weight) + round_neck * weight
        rings.append(np.column_stack([ring, np.full(len(outline), level * height)]))
    stacked = np.stack(rings)
    low = np.broadcast_to([0, 0, 0], stacked[:1].shape)
    high = np.broadcast_to([0, 0, height], stacked[:1].shape)
    return np.concatenate([low, stacked, high]), np.concatenate([levels, top_levels])


def _body_parts(
    outline: np.ndarray, height: float, shoulder: float, neck: float, squareness: float
) -> list[CollisionPart]:
    """Cover the body: cylinder or box up to the shoulder, a convex part above it."""
    width, depth = np.ptp(outline, axis=0)
    level = height * (shoulder + 0.35 * (1 - shoulder))
    if squareness > 5:
        low = collision.box((width, depth, height * shoulder), (0, 0, height * shoulder / 2))
    elif squareness == 2.0 and np.isclose(width, depth):
        low = collision.cylinder(width / 2, 0.0, height * shoulder)
    else:
        low = collision.prism(outline[:: len(outline) // 12][:16], 0.0, height * shoulder)
    rim = outline[:: len(outline) // 12]
    rings = [
        np.column_stack([rim, np.full(len(rim), height * shoulder)]),
        np.column_stack([rim * 0.9, np.full(len(rim), level)]),
        np.column_stack([circle(8) * neck, np.full(8, height)]),
    ]
    return [low, collision.convex(np.concatenate(rings))]


def _ribbed_cap(radius: float, low: float, high: float, color: Color) -> Solid:
    """Make a round cap with a softened top edge."""
    edge = 0.0015
    profile = [(0, low), (radius, low)]
    profile += [(radius, z) for z in np.linspace(low, high - edge, 4)[1:]]
    profile += [(radius - edge, high), (0, high)]
    return Solid.of(revolve(profile, num_columns=28), _ribs(color))


def _ribs(color: Color) -> np.ndarray:
    """Paint vertical grip ribs."""
    dark: Color = (color[0] * 3 // 4, color[1] * 3 // 4, color[2] * 3 // 4)
    poster = Poster(color, (16, 128))
    for rib in range(32):
        poster.rectangle((rib / 32, 0.38, (rib + 0.35) / 32, 0.78), dark)
    return poster.image()


def _cap(
    kind: CapKind, neck: float, base: float, height: float, color: Color
) -> tuple[list[Solid], list[CollisionPart]]:
    """Build a closure that starts at height `base`."""
    low, top = base - 0.003, base + height
    radius = neck * 1.12
    if kind in ("screw", "flip"):
        return [_ribbed_cap(radius, low, top, color)], [collision.cylinder(radius, low, top)]
    if kind == "pump":
        collar, stem = base + 0.014, 0.0045
        spout = np.array([(-0.009, 0), (0.010, 0), (0.028, 0), (0.036, -0.003), (0.039, -0.009)])
        path = np.stack([spout[:, 0], 0 * spout[:, 0], top - 0.007 + spout[:, 1]], axis=1)
        radii = np.array(
            [[0.009, 0.006], [0.009, 0.006], [0.006, 0.005], [0.005, 0.004], [0.004] * 2]
        )
        head = sweep(path, radii, num_columns=14, up=(0, 1, 0))
        post = revolve([(0, low), (stem, low), (stem, top - 0.006), (0, top - 0.006)])
        solids = [
            _ribbed_cap(radius, low, collar, color),
            *(_plain_solid(s, color) for s in (post, head)),
        ]
        parts = [
            collision.cylinder(radius, low, collar),
            collision.cylinder(stem, collar, top - 0.010),
            collision.box((0.050, 0.016, 0.011), (0.013, 0, top - 0.007)),
        ]
        return solids, parts
    return _trigger(radius, low, base, top, color)


def _trigger(
    radius: float, low: float, base: float, top: float, color: Color
) -> tuple[list[Solid], list[CollisionPart]]:
    """Build a spray head that points towards +x."""
    collar = base + 0.020
    head_path = np.array([(-0.026, 0, -0.004), (-0.012, 0, 0), (0.012, 0, 0.001), (0.036, 0, 0)])
    head_path[:, 2] += top - 0.014
    head_radii = np.array([[0.009, 0.009], [0.011, 0.013], [0.011, 0.013], [0.007, 0.008]])
    head = sweep(head_path, head_radii, num_columns=16, up=(0, 0, 1))
    nozzle_path = head_path[[3, 3]] + [(-0.002, 0, 0), (0.010, 0, 0)]
    nozzle = sweep(nozzle_path, 0.0065, num_columns=12)
    throat = revolve([(0, low), (0.010, low), (0.010, top - 0.014), (0, top - 0.014)])
    lever_path = np.array([(0.018, 0, -0.008), (0.026, 0, -0.024), (0.024, 0, -0.042)])
    lever_path[:, 2] += top - 0.012
    lever = sweep(lever_path, np.array([[0.006, 0.003]] * 3), num_columns=10, up=(0, 1, 0))
    solids = [_ribbed_cap(radius, low, collar, color)]
    solids += [_plain_solid(throat, color), _plain_solid(head, color)]
    solids += [_plain_solid(nozzle, (236, 236, 232)), _plain_solid(lever, (236, 236, 232))]
    parts = [
        collision.cylinder(radius, low, collar),
        collision.box((0.022, 0.020, top - 0.014 - collar), (0, 0, (collar + top - 0.014) / 2)),
        collision.box((0.072, 0.022, 0.024), (0.010, 0, top - 0.0135)),
        *collision.capsule_chain(0.0035, lever_path),
    ]
    return solids, parts


def _plain_solid(surface, color: Color) -> Solid:
    """Wrap a surface in one colour."""
    return Solid.of(surface, plain(color))


def tube(
    *, diameter_m: float, width_m: float, height_m: float, cap_color: Color, label: Label
) -> Shape:
    """Shape a squeeze tube standing on its cap: round below, crimped flat at the top.

    Args:
        diameter_m: Diameter above the cap.
        width_m: Width of the crimp.
        height_m: Height with cap.
        cap_color: Colour of the cap.
        label: What is printed on the body.
    """
    cap_height, crimp = 0.024, 0.0022
    radius = diameter_m / 2
    levels = np.linspace(0, 1, 12)
    low, high = cap_height - 0.001, height_m
    outline = circle(_NUM_COLUMNS)
    rings = []
    for level in levels:
        flatten = level**1.3
        half = np.array(
            [radius + (width_m / 2 - radius) * level, radius * (1 - flatten) + crimp * flatten]
        )
        rings.append(
            np.column_stack([outline * half, np.full(len(outline), low + (high - low) * level)])
        )
    poles = [np.broadcast_to([0, 0, z], rings[0].shape) for z in (low, high)]
    body = skin(np.stack([poles[0], *rings, poles[1]]), v=np.concatenate([[0], levels, [1]]))
    solids = [
        Solid.of(body, label.paint()),
        _ribbed_cap_below(radius * 0.92, cap_height, cap_color),
    ]
    few = circle(10)
    hull = [
        np.column_stack([few * radius, np.full(10, low)]),
        np.column_stack([few * [width_m / 2, crimp], np.full(10, high)]),
    ]
    parts = [
        collision.cylinder(radius * 0.92, 0.0, cap_height),
        collision.convex(np.concatenate(hull)),
    ]
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.4)


def _ribbed_cap_below(radius: float, height: float, color: Color) -> Solid:
    """Make a cap that its tube stands on."""
    profile = [(0, 0), (radius - 0.001, 0), (radius, 0.001)]
    profile += [(radius, z) for z in np.linspace(0.006, height, 3)] + [(0, height)]
    return Solid.of(revolve(profile, num_columns=28), _ribs(color))


def spray_can(*, diameter_m: float, height_m: float, cap_color: Color, label: Label) -> Shape:
    """Shape an aerosol can: straight tin, domed shoulder, tall plastic cap."""
    radius, cap_height = diameter_m / 2, 0.036
    base = height_m - cap_height
    levels = np.array([0, 0.005, 0.012, 0.02, 0.2, 0.4, 0.6, 0.8, 0.93, 0.97, 1.0, 1.0])
    shares = np.array([0, 0.94, 1.0, 0.98, 0.98, 0.98, 0.98, 0.98, 0.98, 0.95, 0.86, 0])
    profile = np.stack([radius * shares, base * levels], axis=1)
    body = revolve(profile, num_columns=_NUM_COLUMNS, v=levels)
    cap_radius = radius * 0.90
    solids = [
        Solid.of(body, label.paint()),
        _ribbed_cap(cap_radius, base - 0.004, height_m, cap_color),
    ]
    parts = [
        collision.cylinder(radius, 0.0, base * 0.96),
        collision.cylinder(cap_radius, base * 0.96, height_m),
    ]
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.6)
