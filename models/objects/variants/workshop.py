"""Recipes for hand tools, kitchen tools and locks."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import cutlery, hand_tools
from models.objects.paint import Color
from models.objects.variants.colors import (
    BRIGHT_COLORS,
    color_names,
    contrast,
    draw_color,
    near,
)
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.variants.novelty import may_print

_GRIPS = (*BRIGHT_COLORS, "black", "gray")
_WOODS: tuple[Color, ...] = ((214, 172, 116), (178, 128, 78), (122, 78, 46), (228, 196, 146))


def wrench(rng: np.random.Generator) -> Draft:
    """Draw an adjustable wrench."""
    grip = draw_color(rng, *_GRIPS)
    length = span(rng, 0.150, 0.225)
    shape = partial(
        hand_tools.wrench,
        length_m=length,
        head_m=round(length * span(rng, 0.24, 0.29, 3), 4),
        thickness_m=span(rng, 0.012, 0.017),
        grip=grip,
        seed=draw_seed(rng),
    )
    words = describe(
        "wrench",
        "adjustable wrench",
        "spanner",
        colors=color_names(grip),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=2900.0, source="steel with hollows, plastic grip; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def pliers(rng: np.random.Generator) -> Draft:
    """Draw a pair of pliers."""
    grip = draw_color(rng, *_GRIPS)
    length = span(rng, 0.145, 0.195)
    shape = partial(
        hand_tools.pliers,
        length_m=length,
        width_m=round(length * span(rng, 0.28, 0.36, 3), 4),
        grip=grip,
        seed=draw_seed(rng),
    )
    words = describe(
        "pliers",
        "pair of pliers",
        "pincers",
        colors=color_names(grip),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=2600.0, source="steel jaws, plastic grips; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def claw_hammer(rng: np.random.Generator) -> Draft:
    """Draw a claw hammer."""
    grip, shaft = draw_color(rng, *_GRIPS), near(rng, pick(rng, (*_WOODS, (52, 52, 56))))
    shape = partial(
        hand_tools.claw_hammer,
        length_m=span(rng, 0.190, 0.250),
        head_m=span(rng, 0.082, 0.112),
        grip=grip,
        shaft=shaft,
        seed=draw_seed(rng),
    )
    words = describe(
        "claw hammer",
        "hammer",
        "carpenter's hammer",
        colors=color_names(grip, shaft),
    )
    matter = Matter(density_kg_m3=2200.0, source="steel head, light shaft; assumed")
    return Draft(shape=shape, words=words, matter=matter)


_LOCKS = ("LOCK", "SAFE", "SECURE", "GUARD", "KEY", "40")


def padlock(rng: np.random.Generator) -> Draft:
    """Draw a padlock lying flat."""
    brass: Color = (206, 168, 74)
    color = near(rng, brass) if rng.random() < 0.4 else draw_color(rng)
    width = span(rng, 0.038, 0.054)
    shape = partial(
        hand_tools.padlock,
        body_m=(width, round(width * span(rng, 0.82, 1.02, 3), 4), span(rng, 0.017, 0.024)),
        shackle_m=round(width * span(rng, 0.66, 0.86, 3), 4),
        color=color,
        words=pick(rng, tuple(filter(may_print, _LOCKS))),
        seed=draw_seed(rng),
    )
    words = describe(
        "padlock",
        "lock",
        "metal lock",
        colors=color_names(color),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=2900.0, source="brass with works inside; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def wooden_spoon(rng: np.random.Generator) -> Draft:
    """Draw a wooden spoon."""
    color = near(rng, pick(rng, _WOODS))
    length = span(rng, 0.180, 0.240)
    shape = partial(
        cutlery.wooden_spoon,
        length_m=length,
        bowl_m=(round(length * span(rng, 0.28, 0.34, 3), 4), span(rng, 0.040, 0.052)),
        handle_m=span(rng, 0.0135, 0.0185),
        wood_color=color,
        seed=draw_seed(rng),
    )
    words = describe(
        "wooden spoon", "spoon", "cooking spoon", "stirring spoon", colors=color_names(color)
    )
    matter = Matter(density_kg_m3=700.0, source="beech wood")
    return Draft(shape=shape, words=words, matter=matter)


def fork(rng: np.random.Generator) -> Draft:
    """Draw a fork with a plastic handle."""
    grip = draw_color(rng)
    shape = partial(
        cutlery.fork,
        length_m=span(rng, 0.165, 0.215),
        width_m=span(rng, 0.023, 0.030),
        grip=grip,
        seed=draw_seed(rng),
    )
    words = describe(
        "fork",
        "table fork",
        "dinner fork",
        colors=color_names(grip),
        colored=bool(rng.random() < 0.4),
    )
    matter = Matter(density_kg_m3=1700.0, source="steel and plastic; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def turner(rng: np.random.Generator) -> Draft:
    """Draw a kitchen turner."""
    grip = draw_color(rng, *_GRIPS)
    blade = near(rng, grip) if rng.random() < 0.4 else contrast(rng, grip, 20.0)
    length = span(rng, 0.205, 0.250)
    shape = partial(
        cutlery.turner,
        length_m=length,
        blade_m=(round(length * span(rng, 0.32, 0.38, 3), 4), span(rng, 0.054, 0.072)),
        grip=grip,
        blade=blade,
        seed=draw_seed(rng),
    )
    words = describe(
        "spatula",
        "kitchen turner",
        "turner",
        colors=color_names(grip, blade),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=1200.0, source="nylon and steel; assumed")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe
    for recipe in (wrench, pliers, claw_hammer, padlock, wooden_spoon, fork, turner)
}
