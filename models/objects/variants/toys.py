"""Recipes for toys: balls, wooden blocks, aeroplanes."""

import string
from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import toys
from models.objects.variants.colors import (
    BRIGHT_COLORS,
    color_names,
    contrast,
    draw_color,
    near,
)
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.variants.novelty import may_print
from models.objects.words import ObjectWords

_WOOD = Matter(density_kg_m3=700.0, source="beech wood")
_STAINS = (*BRIGHT_COLORS, "brown", "white")


def _words(
    rng: np.random.Generator, *nouns: str, colors: tuple[str, ...], is_round: bool = False
) -> ObjectWords:
    """Word a toy."""
    return describe(
        *nouns,
        colors=colors,
        colored=bool(rng.random() < 0.6),
        category="toy",
        shapes=("round",) if is_round else (),
        functions=("play",),
    )


_PRINTS = ("PRO", "STAR", "PLAY", "FUN", "JUMP", "GO", "WOW", "POP", "1", "7")


def ball(rng: np.random.Generator) -> Draft:
    """Draw a rubber ball."""
    color = draw_color(rng)
    shape = partial(
        toys.ball,
        diameter_m=span(rng, 0.038, 0.080),
        color=color,
        seam=contrast(rng, color, 14.0),
        words=pick(rng, tuple(filter(may_print, _PRINTS))),
        seed=draw_seed(rng),
    )
    other = pick(rng, ("bouncy ball", "toy ball", "play ball"))
    words = _words(rng, "ball", "rubber ball", other, colors=color_names(color), is_round=True)
    matter = Matter(density_kg_m3=470.0, source="YCB 057: published mass over volume")
    return Draft(shape=shape, words=words, matter=matter)


def block(rng: np.random.Generator) -> Draft:
    """Draw a wooden block with letters: a cube, a brick or a plank."""
    color, edge = draw_color(rng, *_STAINS), span(rng, 0.028, 0.052)
    noun, others, stretch = pick(
        rng,
        (
            ("toy block", ("wooden cube", "letter block"), (1.0, 1.0)),
            ("toy block", ("cube", "building block"), (1.0, 1.0)),
            ("wooden brick", ("toy block", "building block"), (1.5, 2.2)),
        ),
    )
    length = round(edge * span(rng, *stretch, 3), 4)
    shape = partial(
        toys.block,
        size_m=(length, edge, edge if length == edge else round(0.8 * edge, 4)),
        color=color,
        letter=pick(rng, tuple(filter(may_print, string.ascii_uppercase))),
        seed=draw_seed(rng),
    )
    words = _words(rng, noun, *others, colors=color_names(color))
    return Draft(shape=shape, words=words, matter=_WOOD)


def block_cylinder(rng: np.random.Generator) -> Draft:
    """Draw a wooden column."""
    color, diameter = draw_color(rng, *_STAINS), span(rng, 0.028, 0.050)
    shape = partial(
        toys.block_cylinder,
        diameter_m=diameter,
        height_m=round(diameter * span(rng, 0.9, 1.9, 3), 4),
        color=color,
        seed=draw_seed(rng),
    )
    nouns = ("wooden cylinder", "toy cylinder", "round block", "toy column")
    words = _words(rng, *nouns, colors=color_names(color), is_round=True)
    return Draft(shape=shape, words=words, matter=_WOOD)


def block_arch(rng: np.random.Generator) -> Draft:
    """Draw a wooden bridge block."""
    color, width = draw_color(rng, *_STAINS), span(rng, 0.070, 0.110)
    height = round(width * span(rng, 0.46, 0.56, 3), 4)
    shape = partial(
        toys.block_arch,
        size_m=(width, span(rng, 0.025, 0.038), height),
        color=color,
        seed=draw_seed(rng),
    )
    nouns = ("toy arch", "wooden arch", "bridge block", "toy bridge")
    words = _words(rng, *nouns, colors=color_names(color))
    return Draft(shape=shape, words=words, matter=_WOOD)


def airplane(rng: np.random.Generator) -> Draft:
    """Draw a toy aeroplane."""
    body = draw_color(rng, *BRIGHT_COLORS, "white", "gray")
    wing = near(rng, body) if rng.random() < 0.3 else draw_color(rng, *BRIGHT_COLORS, "white")
    length = span(rng, 0.130, 0.185)
    shape = partial(
        toys.airplane,
        length_m=length,
        span_m=round(length * span(rng, 0.80, 1.05, 3), 4),
        body=body,
        wing=wing,
        seed=draw_seed(rng),
    )
    nouns = ("toy airplane", "toy plane", "airplane", "model plane")
    words = _words(rng, *nouns, colors=color_names(body, wing))
    matter = Matter(density_kg_m3=600.0, source="moulded plastic, partly hollow; assumed")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe for recipe in (ball, block, block_cylinder, block_arch, airplane)
}
