"""Procedural textures: noise, gradients, wood, brushed metal, printed labels.

Images are (H, W, 3) uint8 with row 0 at the top. Colours are RGB triples in 0..255.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image, ImageDraw, ImageFont

Color = tuple[int, int, int]

WHITE: Color = (244, 243, 238)
BLACK: Color = (30, 30, 32)
STEEL: Color = (172, 176, 182)
_BOLD = 0.035


def as_image(rgb: np.ndarray) -> np.ndarray:
    """Round and clip (H, W, 3) floats to uint8."""
    return np.clip(np.rint(rgb), 0, 255).astype(np.uint8)


def shade(color: Color, gain: float, lift: float = 0.0) -> Color:
    """Return a darker (`gain` below 1) or lighter colour."""
    r, g, b = (min(255, int(gain * channel + lift)) for channel in color)
    return r, g, b


def plain(color: Color, size_px: int = 8) -> np.ndarray:
    """Return a square image of one colour."""
    return np.full((size_px, size_px, 3), color, np.uint8)


def noise(
    rng: np.random.Generator, shape: tuple[int, int], cells: tuple[int, int], octaves: int = 3
) -> np.ndarray:
    """Draw smooth value noise that wraps around in u.

    Args:
        rng: Source of randomness.
        shape: Height and width of the result, pixels.
        cells: Lattice cells along height and width in the coarsest octave.
        octaves: Each doubles the lattice and halves the amplitude.

    Returns:
        (H, W) float in -1..1.
    """
    total = np.zeros(shape)
    for octave in range(octaves):
        rows, columns = cells[0] << octave, cells[1] << octave
        lattice = rng.uniform(-1, 1, (rows + 1, columns))
        y = np.linspace(0, rows, shape[0], endpoint=False)[:, None]
        x = np.linspace(0, columns, shape[1], endpoint=False)[None]
        y0, x0 = y.astype(int), x.astype(int)
        fade_y, fade_x = _smooth(y - y0), _smooth(x - x0)
        x1 = (x0 + 1) % columns
        low = lattice[y0, x0] * (1 - fade_x) + lattice[y0, x1] * fade_x
        high = lattice[y0 + 1, x0] * (1 - fade_x) + lattice[y0 + 1, x1] * fade_x
        total += (low * (1 - fade_y) + high * fade_y) * 0.5**octave
    return total / (2 - 0.5 ** (octaves - 1))


def _smooth(t: np.ndarray) -> np.ndarray:
    """Fade a fraction of a lattice cell so that the noise has no creases."""
    return t * t * (3 - 2 * t)


def mix(first: ArrayLike, second: ArrayLike, weight: np.ndarray) -> np.ndarray:
    """Blend two colours: (H, W) weights in 0..1 give (H, W, 3) floats."""
    weight = np.clip(weight, 0, 1)[..., None]
    return np.asarray(first, float) * (1 - weight) + np.asarray(second, float) * weight


def lay(image: np.ndarray, color: ArrayLike, weight: np.ndarray) -> np.ndarray:
    """Lay a colour over an (H, W, 3) image with (H, W) opacity in 0..1, as floats."""
    weight = np.clip(weight, 0, 1)[..., None]
    return image * (1 - weight) + np.asarray(color, float) * weight


def grid(shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return u and v at the pixel centres, each (H, W), v = 1 in row 0."""
    u = (np.arange(shape[1]) + 0.5) / shape[1]
    v = 1 - (np.arange(shape[0]) + 0.5) / shape[0]
    return np.meshgrid(u, v)


def mottled(
    rng: np.random.Generator,
    first: Color,
    second: Color,
    shape: tuple[int, int] = (64, 128),
    cells: tuple[int, int] = (4, 6),
) -> np.ndarray:
    """Paint an irregular mixture of two colours."""
    return as_image(mix(first, second, 0.5 + 0.8 * noise(rng, shape, cells, 4)))


def brushed_metal(
    rng: np.random.Generator, color: Color = STEEL, shape: tuple[int, int] = (64, 128)
) -> np.ndarray:
    """Paint metal with fine grinding marks along u."""
    marks = noise(rng, shape, (shape[0] // 2, 3), 2) * 16
    return as_image(np.asarray(color, float) + marks[..., None])


def wood(
    rng: np.random.Generator,
    light: Color = (205, 160, 104),
    dark: Color = (158, 108, 62),
    shape: tuple[int, int] = (128, 128),
) -> np.ndarray:
    """Paint wood whose grain runs along u."""
    _, v = grid(shape)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (9 * v + 1.3 * noise(rng, shape, (3, 2), 2)))
    fibre = noise(rng, shape, (shape[0] // 4, 4), 2)
    return as_image(mix(light, dark, 0.15 + 0.6 * rings**2 + 0.25 * fibre))


class Poster:
    """A printed surface: rectangles, ellipses and words in fractions of the image.

    Coordinates are (x, y) in 0..1 from the top left corner, as on paper.
    """

    def __init__(self, color: Color, shape: tuple[int, int]) -> None:
        """Start with one colour.

        Args:
            color: Background.
            shape: Height and width, pixels.
        """
        self._image = Image.new("RGB", (shape[1], shape[0]), color)
        self._draw = ImageDraw.Draw(self._image)

    def _pixels(self, area: Sequence[float]) -> list[float]:
        """Scale (x0, y0, x1, y1, ...) from fractions to pixels."""
        return [value * self._image.size[k % 2] for k, value in enumerate(area)]

    def rectangle(self, area: Sequence[float], color: Color, radius: float = 0.0) -> "Poster":
        """Fill (x0, y0, x1, y1), corners rounded by `radius` in fractions of the width."""
        pixels = self._pixels(area)
        # PIL includes the last pixel.
        pixels[2] = max(pixels[0], pixels[2] - 1)
        pixels[3] = max(pixels[1], pixels[3] - 1)
        self._draw.rounded_rectangle(pixels, radius * self._image.size[0], fill=color)
        return self

    def ellipse(self, area: Sequence[float], color: Color) -> "Poster":
        """Fill the ellipse in (x0, y0, x1, y1)."""
        self._draw.ellipse(self._pixels(area), fill=color)
        return self

    def polygon(self, points: Sequence[Sequence[float]], color: Color) -> "Poster":
        """Fill a polygon of (x, y) points."""
        flat = self._pixels([value for point in points for value in point])
        self._draw.polygon(list(zip(flat[::2], flat[1::2], strict=True)), fill=color)
        return self

    def gradient(self, area: Sequence[float], top: Color, bottom: Color) -> "Poster":
        """Fill (x0, y0, x1, y1) with a vertical gradient."""
        x0, y0, x1, y1 = (round(value) for value in self._pixels(area))
        weight = np.linspace(0, 1, y1 - y0)[:, None].repeat(x1 - x0, axis=1)
        self._image.paste(Image.fromarray(as_image(mix(top, bottom, weight))), (x0, y0))
        return self

    def words(
        self,
        text: str,
        area: Sequence[float],
        color: Color,
        outline: Color | None = None,
        turn_deg: int = 0,
    ) -> "Poster":
        """Print text as large as fits (x0, y0, x1, y1), centred; lines are split at newlines.

        Args:
            text: What is printed.
            area: The box.
            color: Ink.
            outline: Colour of a bold outline; by default the ink itself.
            turn_deg: 0, 90 to read upwards, or 270 to read downwards.
        """
        x0, y0, x1, y1 = self._pixels(area)
        width, height = (x1 - x0, y1 - y0) if turn_deg == 0 else (y1 - y0, x1 - x0)
        size = _largest_fit(text, width, height)
        stamp = Image.new("L", (max(1, round(width)), max(1, round(height))), 0)
        edge = stamp.copy()
        place = {"xy": (width / 2, height / 2), "text": text, "anchor": "mm", "align": "center"}
        font = ImageFont.load_default(size)
        stroke = max(1, round(size * _BOLD))
        ImageDraw.Draw(edge).text(**place, font=font, fill=255, stroke_width=stroke)
        thin = 0 if outline else stroke
        ImageDraw.Draw(stamp).text(**place, font=font, fill=255, stroke_width=thin)
        for mask, ink in ((edge, outline or color), (stamp, color)):
            turned = mask.rotate(turn_deg, expand=True)
            self._image.paste(Image.new("RGB", turned.size, ink), (round(x0), round(y0)), turned)
        return self

    def barcode(self, rng: np.random.Generator, area: Sequence[float]) -> "Poster":
        """Print a bar code, as packages carry one."""
        x0, y0, x1, y1 = area
        self.rectangle(area, (250, 250, 250))
        edges = np.cumsum(rng.integers(1, 4, 36)).astype(float)
        edges = x0 + (x1 - x0) * (0.06 + 0.88 * edges / edges[-1])
        margin = 0.12 * (y1 - y0)
        for left, right in zip(edges[::2], edges[1::2], strict=True):
            self.rectangle((left, y0 + margin, right, y1 - margin), (20, 20, 20))
        return self

    def small_print(self, area: Sequence[float], color: Color, num_lines: int = 6) -> "Poster":
        """Print lines too small to read."""
        x0, y0, x1, y1 = area
        pitch = (y1 - y0) / num_lines
        for line in range(num_lines):
            end = x1 - (x1 - x0) * 0.13 * ((line * 7) % 4)
            self.rectangle((x0, y0 + line * pitch, end, y0 + (line + 0.45) * pitch), color)
        return self

    def image(self) -> np.ndarray:
        """Return the finished (H, W, 3) uint8 image."""
        return np.asarray(self._image)


def _largest_fit(text: str, width: float, height: float) -> int:
    """Find the largest font size at which the text fits, pixels."""
    probe = ImageDraw.Draw(Image.new("L", (1, 1)))
    low, high = 4, max(5, int(height * 1.6))
    while high - low > 1:
        size = (low + high) // 2
        font = ImageFont.load_default(size)
        box = probe.multiline_textbbox(
            (0, 0), text, font=font, anchor="mm", align="center", stroke_width=round(size * _BOLD)
        )
        fits = box[2] - box[0] <= width and box[3] - box[1] <= height
        low, high = (size, high) if fits else (low, size)
    return low
