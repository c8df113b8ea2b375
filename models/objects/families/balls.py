"""Balls of sport: tennis ball, baseball, golf ball."""

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.paint import Color, as_image, grid, lay, noise, shade
from models.objects.surface import Surface, revolve

_SKIN_PX = (192, 384)
# Shares of the first and third harmonic in the curve that divides a ball into two equal shapes.
_FIRST, _THIRD = 0.75, 0.25


def seamed_ball(
    *, diameter_m: float, skin: Color, seam: Color, stitched: bool = False, fuzz: float, seed: int
) -> Shape:
    """Shape a ball made of two equal pieces, such as a tennis ball or a baseball.

    Args:
        diameter_m: Diameter.
        skin: Colour of felt or leather.
        seam: Colour of the seam.
        stitched: Sew the seam with visible thread, as a baseball's is.
        fuzz: How rough the skin looks, in 0..1.
        seed: Varies the skin.
    """
    rng = np.random.default_rng(seed)
    image = np.asarray(skin, float) + 26 * fuzz * noise(rng, _SKIN_PX, (48, 96), 2)[..., None]
    angle, along = _distance_to_seam()
    if stitched:
        image = lay(image, shade(skin, 0.82), np.clip(1.6 - angle / 0.016, 0, 1))
        thread = (np.sin(along * 52 + angle * 22) > 0.1) & (angle < 0.14) & (angle > 0.025)
        image = lay(image, seam, thread.astype(float))
    else:
        image = lay(image, seam, np.clip(2.4 - angle / 0.030, 0, 1))
    return _sphere(diameter_m, as_image(image))


def golf_ball(*, diameter_m: float, color: Color, num_dimples: int, seed: int) -> Shape:
    """Shape a golf ball; its dimples are painted, as shallow as they are."""
    rng = np.random.default_rng(seed)
    index = np.arange(num_dimples) + 0.5
    height = 1 - 2 * index / num_dimples
    turn = np.pi * (1 + 5**0.5) * index
    ring = np.sqrt(1 - height**2)
    dimples = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    nearness = (_directions() @ dimples.T).max(axis=-1)
    depth = np.clip(1.5 - np.arccos(np.clip(nearness, -1, 1)) * num_dimples**0.5 / 1.1, 0, 1)
    image = np.asarray(color, float) + 4 * noise(rng, _SKIN_PX, (6, 10), 3)[..., None]
    return _sphere(diameter_m, as_image(lay(image, shade(color, 0.66), depth)))


def _sphere(diameter: float, image: np.ndarray) -> Shape:
    """Wrap a sphere in a picture that `_directions` describes."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, 25)
    profile = diameter / 2 * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    profile[[0, -1], 0] = 0.0
    tilt = Rotation.from_euler("xz", [35, 20], degrees=True)
    surface: Surface = revolve(profile).moved(rotation=tilt)
    part = collision.sphere(diameter / 2)
    return Shape(solids=[Solid.of(surface, image)], collision=[part], rolls=True, gloss=0.2)


def _directions() -> np.ndarray:
    """Return the unit vector of every texel, (H, W, 3): u is the azimuth, v the latitude."""
    u, v = grid(_SKIN_PX)
    azimuth, latitude = 2 * np.pi * u, np.pi * (v - 0.5)
    flat = np.cos(latitude)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(latitude)], axis=-1)


def _distance_to_seam() -> tuple[np.ndarray, np.ndarray]:
    """Return each texel's angle to the nearest point of the seam, and that point's parameter."""
    t = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    x = _FIRST * np.cos(t) + _THIRD * np.cos(3 * t)
    y = _FIRST * np.sin(t) - _THIRD * np.sin(3 * t)
    z = 2 * np.sqrt(_FIRST * _THIRD) * np.sin(2 * t)
    closeness = _directions() @ np.stack([x, y, z])
    nearest = closeness.argmax(axis=-1)
    angle = np.arccos(np.clip(closeness.max(axis=-1), -1, 1))
    return angle, t[nearest]
