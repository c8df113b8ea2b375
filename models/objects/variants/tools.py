"""Recipes for tools."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import tools
from models.objects.paint import Color
from models.objects.variants.colors import (
    BRIGHT_COLORS,
    color_name,
    color_names,
    contrast,
    draw_color,
    near,
)
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.variants.novelty import may_print

_HANDLES = (*BRIGHT_COLORS, "black", "gray")


def scissors(rng: np.random.Generator) -> Draft:
    """Draw a pair of scissors."""
    handle = draw_color(rng, *_HANDLES)
    length = span(rng, 0.150, 0.215)
    shape = partial(
        tools.scissors,
        length_m=length,
        width_m=round(length * span(rng, 0.38, 0.48, 3), 4),
        handle=handle,
        seed=draw_seed(rng),
    )
    words = describe(
        "scissors",
        "pair of scissors",
        "shears",
        colors=color_names(handle),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=1870.0, source="YCB 037: published mass over volume")
    return Draft(shape=shape, words=words, matter=matter)


_GRIPS: tuple[Color, ...] = ((86, 52, 34), (126, 82, 48), (44, 40, 40), (172, 42, 40), (60, 66, 74))
_RIVETS: tuple[Color, ...] = ((206, 190, 140), (190, 194, 200), (120, 100, 60))


def knife(rng: np.random.Generator) -> Draft:
    """Draw a kitchen knife."""
    handle = near(rng, pick(rng, _GRIPS))
    shape = partial(
        tools.knife,
        length_m=span(rng, 0.200, 0.245),
        handle=handle,
        rivet=near(rng, pick(rng, _RIVETS), 8),
        seed=draw_seed(rng),
    )
    words = describe("knife", "kitchen knife", "sharp knife", colors=color_names(handle))
    matter = Matter(density_kg_m3=2500.0, source="steel blade, wooden handle; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def screwdriver(rng: np.random.Generator) -> Draft:
    """Draw a flat or a cross-head screwdriver."""
    is_cross = bool(rng.random() < 0.5)
    grip = draw_color(rng, *_HANDLES)
    shape = partial(
        tools.screwdriver,
        length_m=span(rng, 0.150, 0.245),
        handle_m=span(rng, 0.024, 0.036),
        grip=grip,
        accent=contrast(rng, grip, 25.0),
        cross=is_cross,
        seed=draw_seed(rng),
    )
    words = describe(
        "screwdriver",
        *(
            ("phillips screwdriver", "cross screwdriver")
            if is_cross
            else ("flat screwdriver", "slotted screwdriver")
        ),
        colors=color_names(grip),
        colored=bool(rng.random() < 0.4),
    )
    matter = Matter(density_kg_m3=1600.0, source="YCB 044: published mass over volume")
    return Draft(shape=shape, words=words, matter=matter)


_MODELS = ("DRILL", "TURBO", "TORQUE", "MAX", "POWER", "18 VOLT", "IMPACT", "PRO")


def power_drill(rng: np.random.Generator) -> Draft:
    """Draw a cordless drill."""
    body = draw_color(rng, *BRIGHT_COLORS, "gray")
    shape = partial(
        tools.power_drill,
        length_m=span(rng, 0.168, 0.200),
        height_m=span(rng, 0.172, 0.204),
        body=body,
        trim=near(rng, (44, 44, 46), 10),
        words=pick(rng, tuple(filter(may_print, _MODELS))),
    )
    words = describe(
        "power drill",
        "drill",
        "cordless drill",
        colors=(color_name(body), "black"),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(mass_kg=0.895, source="published mass of YCB 035")
    return Draft(shape=shape, words=words, matter=matter)


def clamp(rng: np.random.Generator) -> Draft:
    """Draw a spring clamp."""
    body = draw_color(rng, *_HANDLES)
    length = span(rng, 0.076, 0.125)
    shape = partial(
        tools.clamp,
        length_m=length,
        width_m=round(length * span(rng, 0.66, 0.84, 3), 4),
        thickness_m=span(rng, 0.0105, 0.0160),
        body=body,
        tip=contrast(rng, body, 20.0),
    )
    words = describe(
        "clamp",
        "spring clamp",
        "plastic clamp",
        colors=color_names(body),
        colored=bool(rng.random() < 0.4),
    )
    matter = Matter(density_kg_m3=740.0, source="YCB 049: published mass over volume")
    return Draft(shape=shape, words=words, matter=matter)


def mallet(rng: np.random.Generator) -> Draft:
    """Draw a mallet with a head of one or two colours."""
    first = draw_color(rng)
    second = near(rng, first, 4) if rng.random() < 0.4 else draw_color(rng)
    shape = partial(
        tools.mallet,
        length_m=span(rng, 0.170, 0.245),
        head_m=(span(rng, 0.028, 0.044), span(rng, 0.066, 0.100)),
        faces=(first, second),
        seed=draw_seed(rng),
    )
    words = describe(
        "mallet",
        "hammer",
        "rubber mallet",
        colors=color_names(first, second),
        colored=bool(rng.random() < 0.4),
    )
    matter = Matter(density_kg_m3=950.0, source="rubber head, wooden handle; assumed")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe for recipe in (scissors, knife, screwdriver, power_drill, clamp, mallet)
}
