"""Packages: cans and cartons with printed faces."""

import zlib
from typing import Literal

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Panel, Solid
from models.objects.paint import BLACK, STEEL, WHITE, Color, Poster, as_image, noise
from models.objects.surface import circle, disc, revolve, rounded_box

Picture = Literal["disc", "band", "rays"]
_TEXEL_M = 0.0008


def can(
    *,
    diameter_m: float,
    height_m: float,
    title: str,
    subtitle: str,
    top: Color,
    bottom: Color,
    ink: Color,
    accent: Color,
    squareness: float = 2.0,
    aspect: float = 1.0,
    seed: int,
) -> Shape:
    """Shape a food can: two-coloured label twice around, rims, ridged metal lids.

    Args:
        diameter_m: Extent along x.
        height_m: Height.
        title: Words on the label.
        subtitle: Line below.
        top: Colour of the label's upper half.
        bottom: Colour of its lower half.
        ink: Colour of the title.
        accent: Colour of the emblem.
        squareness: Exponent of the superelliptic section, 2 for round.
        aspect: Extent along y over extent along x.
        seed: Varies lids and bar code.
    """
    rng = np.random.default_rng(seed)
    r, h = diameter_m / 2, height_m
    rim = 0.0025
    side = np.array(
        [(r - 0.002, 0.0), (r, 0.001), (r, rim), (r - 0.001, rim + 0.001)]
        + [(r - 0.001, z) for z in np.linspace(rim + 0.004, h - rim - 0.004, 5)]
        + [(r - 0.001, h - rim - 0.001), (r, h - rim), (r, h - 0.001), (r - 0.002, h)]
    )
    outline = circle(48, squareness, aspect)
    wall = revolve(side, section=outline, v=side[:, 1] / h)
    ring = outline * (r - 0.002)
    lids = [
        Panel(
            surface=disc(np.column_stack([ring, np.full(48, z)]), faces_up=z > 0),
            image=_lid(rng),
        )
        for z in (0.0, h)
    ]
    label = _can_label(title, subtitle, top, bottom, ink, accent, rng)
    body = Solid(panels=(Panel(surface=wall, image=label), *lids))
    if squareness == 2.0:
        part = collision.cylinder(r, 0.0, h)
    else:
        # Flat sides, so that it does not rock; the corners are cut.
        corners = [(1, 0.6), (0.8, 1), (-0.8, 1), (-1, 0.6), (-1, -0.6), (-0.8, -1)]
        octagon = np.array([*corners, (0.8, -1), (1, -0.6)]) * [r, aspect * r]
        part = collision.prism(octagon, 0.0, h)
    return Shape(solids=[body], collision=[part], rolls=squareness == 2.0, gloss=0.5)


def _lid(rng: np.random.Generator) -> np.ndarray:
    """Paint a metal lid with concentric ridges."""
    y, x = np.mgrid[-1:1:96j, -1:1:96j]
    radius = np.hypot(x, y)
    ridges = 14 * np.sin(radius * 38) * (radius > 0.45) - 30 * (np.abs(radius - 0.9) < 0.03)
    return as_image(
        np.asarray(STEEL, float) + (ridges + 6 * noise(rng, radius.shape, (24, 24), 1))[..., None]
    )


def _can_label(
    title: str,
    subtitle: str,
    top: Color,
    bottom: Color,
    ink: Color,
    accent: Color,
    rng: np.random.Generator,
) -> np.ndarray:
    """Print a can's label: the same front twice, a bar code between."""
    poster = Poster(bottom, (224, 480)).rectangle((0, 0, 1, 0.5), top)
    for left in (0.0, 0.5):
        poster.words(title, (left + 0.02, 0.09, left + 0.38, 0.36), ink)
        poster.ellipse((left + 0.12, 0.39, left + 0.28, 0.68), accent)
        poster.ellipse((left + 0.14, 0.43, left + 0.26, 0.64), bottom)
        poster.words(subtitle, (left + 0.03, 0.70, left + 0.37, 0.90), accent, accent)
        poster.small_print((left + 0.41, 0.56, left + 0.48, 0.88), BLACK, 8)
    poster.barcode(rng, (0.41, 0.14, 0.48, 0.42))
    poster.rectangle((0, 0, 1, 0.035), STEEL).rectangle((0, 0.965, 1, 1), STEEL)
    return poster.image()


def carton(
    *,
    size_m: tuple[float, float, float],
    title: str,
    subtitle: str,
    ground: Color,
    ink: Color,
    accent: Color,
    picture: Picture = "disc",
    seed: int = 0,
) -> Shape:
    """Shape a printed carton with its large front towards -y in the upright pose.

    Args:
        size_m: Width, depth and height.
        title: Words on the front and on the narrow sides.
        subtitle: Second line on the front.
        ground: Colour of the board.
        ink: Colour of the title.
        accent: Colour of picture and bands.
        picture: "disc", "band" or "rays".
        seed: Varies the bar code.
    """
    rng = np.random.default_rng([seed, zlib.crc32(title.encode())])
    width, depth, height = size_m
    front = _front((height, width), title, subtitle, ground, ink, accent, picture)
    side = _narrow((height, depth), title, ground, ink, accent, rng)
    end = _lid_print((depth, width), title, ground, ink, accent)
    images = [side, side, front, front, end, end]
    sides = rounded_box(size_m, min(0.0012, 0.2 * min(size_m)))
    panels = tuple(
        Panel(surface=surface.moved((0, 0, height / 2)), image=image)
        for surface, image in zip(sides, images, strict=True)
    )
    parts = [collision.box(size_m, (0, 0, height / 2))]
    return Shape(solids=[Solid(panels=panels)], collision=parts, gloss=0.25)


def _pixels(extent_m: tuple[float, float]) -> tuple[int, int]:
    """Give a face (height, width) enough texels, at most 240 along a side."""
    rows, columns = (value / _TEXEL_M for value in extent_m)
    shrink = min(1.0, 240 / max(rows, columns))
    return max(16, round(rows * shrink)), max(16, round(columns * shrink))


def _front(
    extent: tuple[float, float],
    title: str,
    subtitle: str,
    ground: Color,
    ink: Color,
    accent: Color,
    picture: Picture,
) -> np.ndarray:
    """Print the large face of a carton."""
    poster = Poster(ground, _pixels(extent))
    tall = extent[0] > 1.15 * extent[1]
    art = (0.16, 0.46, 0.84, 0.84) if tall else (0.56, 0.22, 0.94, 0.86)
    if picture == "rays":
        center = ((art[0] + art[2]) / 2, (art[1] + art[3]) / 2)
        for ray in range(12):
            spread = np.array([ray, ray + 0.5]) * (np.pi / 6)
            tips = [(center[0] + 1.3 * np.cos(a), center[1] + 1.3 * np.sin(a)) for a in spread]
            poster.polygon([center, *tips], _between(ground, accent))
    if picture == "band":
        poster.rectangle((0, 0.42, 1, 0.88) if tall else (0.52, 0, 1, 1), accent)
    poster.ellipse(art, WHITE if picture == "band" else accent)
    inset = 0.05
    poster.ellipse((art[0] + inset, art[1] + inset, art[2] - inset, art[3] - inset), ground)
    poster.words(title, (0.05, 0.06, 0.95, 0.40) if tall else (0.04, 0.14, 0.53, 0.62), ink)
    small = (0.10, 0.87, 0.90, 0.97) if tall else (0.06, 0.68, 0.52, 0.88)
    return poster.words(subtitle, small, ink).image()


def _between(first: Color, second: Color) -> Color:
    """Return the colour halfway."""
    r, g, b = ((a + c) // 2 for a, c in zip(first, second, strict=True))
    return r, g, b


def _narrow(
    extent: tuple[float, float],
    title: str,
    ground: Color,
    ink: Color,
    accent: Color,
    rng: np.random.Generator,
) -> np.ndarray:
    """Print a narrow side: title along the longer way, table of contents, bar code."""
    poster = Poster(ground, _pixels(extent))
    line = title.replace("\n", " ")
    if extent[0] > extent[1]:
        poster.rectangle((0, 0, 1, 0.06), accent)
        poster.words(line, (0.15, 0.42, 0.85, 0.96), ink, turn_deg=90)
        poster.rectangle((0.12, 0.10, 0.88, 0.26), WHITE).small_print(
            (0.18, 0.12, 0.82, 0.25), BLACK
        )
        return poster.barcode(rng, (0.12, 0.28, 0.88, 0.38)).image()
    poster.rectangle((0, 0, 0.05, 1), accent).words(line, (0.08, 0.15, 0.6, 0.85), ink)
    return poster.barcode(rng, (0.68, 0.2, 0.94, 0.8)).image()


def _lid_print(
    extent: tuple[float, float], title: str, ground: Color, ink: Color, accent: Color
) -> np.ndarray:
    """Print the flaps at top and bottom."""
    poster = Poster(ground, _pixels(extent)).rectangle((0, 0.46, 1, 0.54), _between(ground, accent))
    poster.words(title.replace("\n", " "), (0.12, 0.15, 0.88, 0.85), ink)
    return poster.image()
