"""Cleaning things: sponge and brush."""

import numpy as np

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid, box_solid
from models.objects.paint import Color, as_image, noise, shade, wood
from models.objects.surface import circle, sweep


def sponge(*, size_m: tuple[float, float, float], foam: Color, pad: Color, seed: int) -> Shape:
    """Shape a kitchen sponge: porous foam below, a scouring pad on top."""
    rng = np.random.default_rng(seed)
    width, depth, height = size_m
    share = 0.72
    pores = _porous(rng, foam)
    felt = as_image(np.asarray(pad, float) + 26 * noise(rng, (96, 144), (48, 72), 1)[..., None])
    foam_size = (width, depth, share * height)
    pad_size = (0.995 * width, 0.995 * depth, (1 - share) * height + 0.001)
    solids = [
        box_solid(foam_size, 0.003, pores, (0, 0, share * height / 2)),
        box_solid(pad_size, 0.0012, felt, (0, 0, height - pad_size[2] / 2)),
    ]
    parts = [collision.box(size_m, (0, 0, height / 2))]
    return Shape(solids=solids, collision=parts, gloss=0.05)


def _porous(rng: np.random.Generator, foam: Color) -> np.ndarray:
    """Paint foam with dark pores of several sizes."""
    image = np.asarray(foam, float) * np.ones((96, 144, 1))
    coarse, fine = noise(rng, (96, 144), (16, 24), 2), noise(rng, (96, 144), (40, 60), 1)
    holes = (coarse > 0.38) | (fine > 0.62)
    image[holes] = np.asarray(shade(foam, 0.66), float)
    return as_image(image)


def brush(
    *,
    length_m: float,
    head_m: tuple[float, float],
    height_m: float,
    back: Color,
    bristle: Color,
    seed: int,
) -> Shape:
    """Shape a scrubbing brush standing on its bristles, handle towards -x.

    Args:
        length_m: Length with handle.
        head_m: Length and width of the head.
        height_m: Height of head and bristles together.
        back: Colour of the wood.
        bristle: Colour of the bristles.
        seed: Varies grain and bristles.
    """
    rng = np.random.default_rng(seed)
    grain = np.rot90(wood(rng, back, shade(back, 0.82), (96, 160))).copy()
    board = 0.42 * height_m
    head_x = length_m - head_m[0] / 2
    x = np.concatenate(
        [
            np.linspace(0, length_m - head_m[0] - 0.010, 6),
            np.linspace(length_m - head_m[0], length_m, 9),
        ]
    )
    narrow, wide = 0.26 * head_m[1], 0.5 * head_m[1]
    grip = narrow * np.array([0.6, 0.95, 1.05, 1.0, 0.9, 1.0])
    round_end = wide * np.sqrt(np.clip(1 - np.linspace(-0.97, 0.98, 9) ** 4, 0.05, 1))
    half = np.stack([np.concatenate([grip, round_end]), np.full(15, board / 2)], axis=1)
    path = np.stack([x, 0 * x, 0 * x + height_m - board / 2], axis=1)
    body = sweep(path, half, section=circle(28, 4.0))
    tufts = np.asarray(bristle, float) + 40 * noise(rng, (64, 160), (2, 80), 2)[..., None]
    tufts[:, ::8] *= 0.7
    block = (0.88 * head_m[0], 0.84 * head_m[1], height_m - board + 0.002)
    block_at = (head_x, 0, block[2] / 2)
    # Lets the handle hang level: the bristles carry the brush.
    parts = [
        collision.box(block, block_at),
        collision.box((*head_m, board), (head_x, 0, height_m - board / 2)),
        collision.box(
            (length_m - head_m[0], 1.9 * narrow, 0.95 * board),
            ((length_m - head_m[0]) / 2, 0, height_m - board / 2),
        ),
    ]
    solids = [Solid.of(body, grain), box_solid(block, 0.002, as_image(tufts), block_at)]
    return Shape(solids=solids, collision=parts, gloss=0.2)
