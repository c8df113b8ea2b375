"""Names of colours, and colours drawn by name.

A colour is named in CIELAB (CIE 15:2004, D65 white; sRGB as in IEC 61966-2-1) by its lightness L,
chroma C and hue angle h in degrees:

- C < 12, or C < 20 and L < 20: black below L 28, white from L 80, gray between
- C < 22, L >= 85 and h 60...115 (cream, ivory): white
- h 42...78: orange, but brown when dark (L < 55) or dull (C < 42)
- h 78...103, from L 80 up to 112: yellow, but when dark or dull (L < 62 or C < 22) brown up to h
  95, then green
- up to h 198, below L 55 (teal) up to h 211: green
- up to h 308: blue
- h 308...345: purple, but pink from L 62
- h 345...42, across zero: red, but pink from L 60 (from L 52 up to h 15), purple when dark and
  bluish (L < 32, h > 345), brown when dull (C < 30) from h 20
"""

import numpy as np

from models.objects.paint import Color
from models.objects.variants.draft import pick

# Columns of linear sRGB in CIE XYZ, relative to the D65 white point.
_XYZ_OF_RGB = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
_WHITE_XYZ = np.array([0.95047, 1.0, 1.08883])

_ANCHORS: dict[str, tuple[Color, ...]] = {
    "red": ((196, 28, 34), (222, 44, 40), (156, 20, 30)),
    "yellow": ((246, 208, 44), (250, 226, 96), (232, 186, 30)),
    "orange": ((236, 120, 30), (246, 148, 52), (220, 100, 36)),
    "green": ((44, 142, 70), (120, 188, 80), (24, 96, 60), (150, 206, 160), (30, 150, 130)),
    "blue": ((30, 84, 182), (70, 156, 220), (24, 48, 120), (150, 196, 232), (40, 150, 180)),
    "purple": ((110, 54, 150), (166, 120, 204), (80, 36, 104)),
    "pink": ((238, 146, 176), (232, 96, 150), (244, 186, 198)),
    "brown": ((112, 70, 42), (146, 96, 58), (84, 54, 38)),
    "black": ((36, 36, 38), (48, 46, 50)),
    "white": ((242, 242, 238), (236, 232, 222)),
    "gray": ((128, 132, 138), (170, 174, 178), (96, 98, 104)),
}
ALL_COLORS = tuple(_ANCHORS)
BRIGHT_COLORS = ("red", "yellow", "orange", "green", "blue", "purple", "pink")
_JITTER = 12


def lab(rgb: Color) -> tuple[float, float, float]:
    """Return lightness (0..100), chroma and hue angle (degrees) of an RGB triple in 0..255."""
    value = np.asarray(rgb, float) / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    t = _XYZ_OF_RGB @ linear / _WHITE_XYZ
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    a, b = 500 * (f[0] - f[1]), 200 * (f[1] - f[2])
    hue = float(np.degrees(np.arctan2(b, a))) % 360
    return float(116 * f[1] - 16), float(np.hypot(a, b)), hue


def color_name(rgb: Color) -> str:
    """Name a colour.

    Args:
        rgb: Triple in 0..255.

    Returns:
        One of `models.objects.words.COLORS`, by the thresholds at the head of this module.
    """
    lightness, chroma, hue = lab(rgb)
    if chroma < 12 or (chroma < 20 and lightness < 20):
        return "black" if lightness < 28 else "white" if lightness >= 80 else "gray"
    if chroma < 22 and lightness >= 85 and 60 <= hue < 115:
        return "white"
    if 42 <= hue < (112 if lightness >= 80 else 103):
        return _warm_name(lightness, chroma, hue)
    if 42 <= hue < 308:
        return "green" if hue < (211 if lightness < 55 else 198) else "blue"
    if 308 <= hue < 345:
        return "pink" if lightness >= 62 else "purple"
    return _reddish_name(lightness, chroma, hue)


def _warm_name(lightness: float, chroma: float, hue: float) -> str:
    """Name what lies between red and green."""
    if hue < 78:
        return "brown" if lightness < 55 or chroma < 42 else "orange"
    if lightness >= 62 and chroma >= 22:
        return "yellow"
    return "brown" if hue < 95 else "green"


def _reddish_name(lightness: float, chroma: float, hue: float) -> str:
    """Name what lies about hue zero."""
    if lightness >= (60 if 15 <= hue < 345 else 52):
        return "pink"
    if lightness < 32 and hue > 345:
        return "purple"
    return "brown" if chroma < 30 and 20 <= hue < 42 else "red"


def color_names(*colors: Color) -> tuple[str, ...]:
    """Name several colours, most dominant first, each name once."""
    return tuple(dict.fromkeys(color_name(color) for color in colors))


def near(rng: np.random.Generator, color: Color, jitter: int = _JITTER) -> Color:
    """Draw a colour that differs by at most `jitter` in each channel."""
    shift = rng.integers(-jitter, jitter + 1, 3)
    r, g, b = (int(np.clip(channel + d, 0, 255)) for channel, d in zip(color, shift, strict=True))
    return r, g, b


def draw_color(rng: np.random.Generator, *names: str) -> Color:
    """Draw a colour that goes by one of the names, or by any when none is given."""
    name = pick(rng, names or ALL_COLORS)
    # The eye sees the slightest tint in what has no hue.
    jitter = 4 if name in ("black", "white", "gray") else _JITTER
    color = near(rng, pick(rng, _ANCHORS[name]), jitter)
    while color_name(color) != name:
        color = near(rng, pick(rng, _ANCHORS[name]), jitter)
    return color


def contrast(rng: np.random.Generator, ground: Color, least: float = 38.0) -> Color:
    """Draw a colour whose lightness differs from a ground's by at least `least`, for print.

    Where chance finds none in 40 draws it is black or white, whichever stands out more.
    """
    level = lab(ground)[0]
    for _ in range(40):
        color = draw_color(rng)
        if abs(lab(color)[0] - level) >= least:
            return color
    return _ANCHORS["black" if level > 54 else "white"][0]
