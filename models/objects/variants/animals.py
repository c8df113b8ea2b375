"""Recipes for toy animals: proportions and colours varied."""

from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np

from models.objects.asset import Matter
from models.objects.families import animals, figures
from models.objects.families.animals import Animal
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
from models.objects.variants.species import SPECIES

_PLASTIC = Matter(density_kg_m3=800.0, source="moulded plastic animal; assumed")
_HORN: Color = (226, 214, 186)


def _varied(rng: np.random.Generator, animal: Animal) -> Animal:
    """Scale every proportion by up to 7 % and the size by up to 15 %."""
    changes: dict[str, Any] = {}
    for field in fields(animal):
        value, reach = getattr(animal, field.name), 0.15 if field.name == "body_m" else 0.07
        if isinstance(value, tuple):
            changes[field.name] = tuple(_scaled(rng, part, reach) for part in value)
        else:
            changes[field.name] = _scaled(rng, value, reach)
    return replace(animal, **changes)


def _scaled(rng: np.random.Generator, value: float, reach: float) -> float:
    """Scale a number by up to a share of itself."""
    return round(value * span(rng, 1 - reach, 1 + reach), 4)


def quadruped(rng: np.random.Generator) -> Draft:
    """Draw a standing toy animal, one in five in a colour that nature has not thought of."""
    species = pick(rng, SPECIES)
    coat, marks = pick(rng, species.coats)
    coat, marks = near(rng, coat, 10), near(rng, marks, 8)
    is_fancy = rng.random() < 0.2
    if is_fancy:
        coat = draw_color(rng, *BRIGHT_COLORS)
        marks = contrast(rng, coat, 30.0)
    shape = partial(
        animals.quadruped,
        animal=_varied(rng, species.animal),
        coat=coat,
        marks=marks,
        pattern=species.pattern,
        crest=species.crest,
        crest_color=marks,
        trunk=species.trunk,
        extra=species.extra,
        extra_color=contrast(rng, coat, 15.0) if is_fancy else near(rng, _HORN),
        seed=draw_seed(rng),
    )
    has_pattern = species.pattern != "plain"
    noun = species.noun
    words = describe(
        f"toy {noun}",
        noun,
        f"{noun} figure",
        "toy animal",
        colors=color_names(coat, marks) if has_pattern else (color_name(coat),),
        colored=bool(is_fancy and rng.random() < 0.7),
        category="toy",
        functions=("play",),
    )
    return Draft(shape=shape, words=words, matter=_PLASTIC)


def duck(rng: np.random.Generator) -> Draft:
    """Draw a bath duck, mostly yellow."""
    body = draw_color(rng, "yellow") if rng.random() < 0.4 else draw_color(rng)
    shape = partial(
        figures.duck,
        length_m=span(rng, 0.060, 0.090),
        body=body,
        beak=draw_color(rng, "orange", "orange", "red", "yellow"),
        seed=draw_seed(rng),
    )
    words = describe(
        "rubber duck",
        "bath duck",
        "toy duck",
        "duck",
        colors=color_names(body),
        colored=bool(rng.random() < 0.4),
        category="toy",
        functions=("play",),
    )
    matter = Matter(density_kg_m3=300.0, source="hollow vinyl; assumed")
    return Draft(shape=shape, words=words, matter=matter)


# Noun, other noun, radius and height of the ears, radius of the head, tail, fur and face.
_SITTING: tuple[
    tuple[str, str, tuple[float, float], float, bool, tuple[tuple[Color, Color], ...]], ...
] = (
    ("monkey", "toy ape", (0.38, 0.15), 0.25, True, (((112, 70, 40), (226, 186, 142)),)),
    ("gorilla", "toy ape", (0.22, 0.10), 0.24, False, (((52, 50, 54), (110, 106, 106)),)),
    (
        *("teddy bear", "stuffed bear", (0.36, 0.75), 0.27, False),
        *((((166, 112, 62), (226, 186, 132)), ((236, 226, 208), (214, 190, 160))),),
    ),
    ("panda", "panda bear", (0.34, 0.78), 0.27, False, (((38, 38, 40), (240, 240, 236)),)),
    ("koala", "koala bear", (0.50, 0.55), 0.27, False, (((146, 150, 156), (226, 222, 216)),)),
)


def sitting_animal(rng: np.random.Generator) -> Draft:
    """Draw a sitting monkey, gorilla, teddy bear, panda or koala."""
    noun, other, (ear, rise), head, has_tail, coats = pick(rng, _SITTING)
    fur, face = pick(rng, coats)
    if noun in ("monkey", "teddy bear") and rng.random() < 0.35:
        fur = draw_color(rng, *BRIGHT_COLORS)
    fur = near(rng, fur, 8)
    shape = partial(
        figures.sitting_animal,
        height_m=span(rng, 0.078, 0.115),
        fur=fur,
        face=near(rng, face, 8),
        ear=(_scaled(rng, ear, 0.08), _scaled(rng, rise, 0.08)),
        head=_scaled(rng, head, 0.05),
        tail=has_tail,
        seed=draw_seed(rng),
    )
    words = describe(
        noun,
        f"toy {noun}",
        other,
        "toy animal",
        colors=color_names(fur, face) if noun == "panda" else color_names(fur),
        colored=bool(noun != "panda" and rng.random() < 0.2),
        category="toy",
        functions=("play",),
    )
    return Draft(shape=shape, words=words, matter=_PLASTIC)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe for recipe in (quadruped, duck, sitting_animal)
}
