"""Recipes for fruit, in the colours in which it grows."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import fruit
from models.objects.paint import Color
from models.objects.variants.colors import near
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.words import ObjectWords

_FLESH = Matter(density_kg_m3=900.0, source="fresh fruit")
_Range = tuple[float, float]


def _words(
    rng: np.random.Generator, noun: str, kind: str, *others: str, color: str, is_round: bool = True
) -> ObjectWords:
    """Word a fruit by the usual noun, its kind and its colour."""
    return describe(
        noun,
        kind,
        *others,
        colors=(color,),
        colored=bool(rng.random() < 0.4),
        category="fruit",
        shapes=("round",) if is_round else (),
        functions=("eat",),
    )


# Colour, kind, ground colour, blush, share of the blush.
_APPLES: tuple[tuple[str, str, Color, Color, _Range], ...] = (
    ("red", "sweet apple", (196, 96, 48), (178, 20, 30), (1.1, 1.4)),
    ("red", "dark apple", (150, 40, 40), (120, 12, 28), (0.9, 1.3)),
    ("green", "sour apple", (134, 184, 62), (152, 192, 76), (0.2, 0.6)),
    ("yellow", "golden apple", (232, 204, 84), (226, 186, 70), (0.2, 0.6)),
)


def apple(rng: np.random.Generator) -> Draft:
    """Draw a red, green or yellow apple."""
    color, kind, base, blush, amount = pick(rng, _APPLES)
    diameter = span(rng, 0.060, 0.082)
    shape = partial(
        fruit.apple,
        diameter_m=diameter,
        height_m=round(diameter * span(rng, 0.84, 0.98, 3), 4),
        base=near(rng, base, 8),
        blush=near(rng, blush, 8),
        blush_amount=span(rng, *amount, 2),
        seed=draw_seed(rng),
    )
    words = _words(rng, "apple", kind, "fresh apple", color=color)
    return Draft(shape=shape, words=words, matter=_FLESH)


# Noun, kind, colour, diameters (m), ground colour, blush, share of the blush, fuzz.
_DRUPES: tuple[tuple[str, str, str, _Range, Color, Color, _Range, _Range], ...] = (
    (
        *(
            "peach",
            "ripe peach",
            "orange",
            (0.054, 0.072),
            (246, 178, 92),
            (214, 84, 58),
            (0.4, 0.8),
        ),
        *((0.8, 1.0),),
    ),
    (
        *(
            "nectarine",
            "smooth peach",
            "red",
            (0.050, 0.066),
            (224, 96, 60),
            (176, 24, 36),
            (0.9, 1.2),
        ),
        *((0.0, 0.1),),
    ),
    (
        *("apricot", "ripe apricot", "orange", (0.038, 0.050), (246, 164, 60), (236, 130, 50)),
        *((0.2, 0.5), (0.5, 0.8)),
    ),
    (
        *("plum", "ripe plum", "purple", (0.040, 0.056), (112, 40, 96), (70, 22, 74), (0.7, 1.0)),
        *((0.0, 0.2),),
    ),
    (
        *(
            "plum",
            "mirabelle",
            "yellow",
            (0.034, 0.044),
            (240, 196, 60),
            (230, 186, 50),
            (0.3, 0.6),
        ),
        *((0.0, 0.2),),
    ),
    (
        *("plum", "cherry plum", "red", (0.034, 0.048), (176, 26, 40), (140, 16, 34), (0.6, 1.0)),
        *((0.0, 0.2),),
    ),
)


def drupe(rng: np.random.Generator) -> Draft:
    """Draw a peach, nectarine, apricot or plum."""
    noun, kind, color, diameters, base, blush, amount, fuzz = pick(rng, _DRUPES)
    shape = partial(
        fruit.drupe,
        diameter_m=span(rng, *diameters),
        base=near(rng, base, 8),
        blush=near(rng, blush, 8),
        blush_amount=span(rng, *amount, 2),
        fuzz=span(rng, *fuzz, 2),
        seed=draw_seed(rng),
    )
    words = _words(rng, noun, kind, "stone fruit", color=color)
    return Draft(shape=shape, words=words, matter=_FLESH)


# Noun, kind, colour, diameters (m), length over diameter (0: round), peel, shade.
_CITRUS: tuple[tuple[str, str, str, _Range, _Range, Color, Color], ...] = (
    (
        "orange",
        "sweet orange",
        "orange",
        (0.064, 0.080),
        (0.0, 0.0),
        (244, 140, 28),
        (226, 112, 20),
    ),
    ("tangerine", "mandarin", "orange", (0.046, 0.060), (0.0, 0.0), (246, 128, 24), (230, 104, 18)),
    ("grapefruit", "pomelo", "yellow", (0.076, 0.084), (0.0, 0.0), (244, 206, 92), (240, 186, 80)),
    ("lemon", "sour lemon", "yellow", (0.046, 0.060), (1.2, 1.4), (248, 222, 48), (226, 190, 30)),
    ("lime", "sour lime", "green", (0.040, 0.052), (1.12, 1.28), (106, 164, 48), (74, 132, 36)),
)


def citrus(rng: np.random.Generator) -> Draft:
    """Draw an orange, tangerine, grapefruit, lemon or lime."""
    noun, kind, color, diameters, stretch, peel, dark = pick(rng, _CITRUS)
    diameter = span(rng, *diameters)
    has_nubs = stretch[0] > 0
    ratio = span(rng, *stretch, 3) if has_nubs else span(rng, 0.94, 1.0, 3)
    shape = partial(
        fruit.citrus,
        diameter_m=diameter,
        length_m=round(diameter * ratio, 4),
        nub_m=span(rng, 0.006, 0.011) if has_nubs else 0.0,
        peel=near(rng, peel, 6),
        shade=near(rng, dark, 6),
        seed=draw_seed(rng),
    )
    words = _words(rng, noun, kind, "citrus fruit", color=color, is_round=not has_nubs)
    return Draft(shape=shape, words=words, matter=_FLESH)


_PEARS: tuple[tuple[str, Color, Color], ...] = (
    ("green", (146, 182, 62), (176, 188, 72)),
    ("yellow", (230, 208, 92), (222, 188, 80)),
    ("red", (176, 40, 44), (150, 24, 36)),
    ("brown", (156, 112, 58), (138, 92, 46)),
)


def pear(rng: np.random.Generator) -> Draft:
    """Draw a pear lying on its side."""
    color, base, blush = pick(rng, _PEARS)
    diameter = span(rng, 0.056, 0.072)
    shape = partial(
        fruit.pear,
        diameter_m=diameter,
        height_m=round(diameter * span(rng, 1.40, 1.65, 3), 4),
        base=near(rng, base, 8),
        blush=near(rng, blush, 8),
        seed=draw_seed(rng),
    )
    words = _words(rng, "pear", "ripe pear", "fresh pear", color=color, is_round=False)
    return Draft(shape=shape, words=words, matter=_FLESH)


def strawberry(rng: np.random.Generator) -> Draft:
    """Draw a strawberry."""
    diameter = span(rng, 0.034, 0.048)
    shape = partial(
        fruit.strawberry,
        diameter_m=diameter,
        length_m=round(diameter * span(rng, 1.10, 1.38, 3), 4),
        base=near(rng, (206, 24, 32), 14),
        shade=near(rng, (158, 12, 24), 10),
        seed=draw_seed(rng),
    )
    words = _words(rng, "strawberry", "ripe strawberry", "berry", color="red", is_round=False)
    return Draft(shape=shape, words=words, matter=_FLESH)


_BANANAS: tuple[tuple[str, str, Color, Color], ...] = (
    ("yellow", "ripe banana", (248, 214, 48), (214, 172, 36)),
    ("yellow", "fresh banana", (244, 220, 84), (222, 190, 60)),
    ("green", "unripe banana", (156, 190, 66), (120, 162, 52)),
)


def banana(rng: np.random.Generator) -> Draft:
    """Draw a ripe or a green banana."""
    color, kind, peel, dark = pick(rng, _BANANAS)
    length = span(rng, 0.155, 0.205)
    shape = partial(
        fruit.banana,
        diameter_m=round(length * span(rng, 0.172, 0.196, 3), 4),
        length_m=length,
        peel=near(rng, peel, 8),
        shade=near(rng, dark, 8),
        seed=draw_seed(rng),
    )
    words = _words(rng, "banana", kind, "tropical fruit", color=color, is_round=False)
    return Draft(shape=shape, words=words, matter=_FLESH)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe for recipe in (apple, drupe, citrus, pear, strawberry, banana)
}
