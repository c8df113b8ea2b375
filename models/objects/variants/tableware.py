"""Recipes for tableware and open containers, in any colour."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import containers
from models.objects.variants.colors import color_names, contrast, draw_color, near
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span

_CERAMIC = Matter(density_kg_m3=1500.0, source="glazed earthenware, porous; assumed")
_PLASTIC = Matter(density_kg_m3=1050.0, source="polystyrene")
_HOLD = ("hold other things",)


def mug(rng: np.random.Generator) -> Draft:
    """Draw a mug of any colour, inside white or coloured, with a band."""
    outside = draw_color(rng)
    inside = draw_color(rng, "white") if rng.random() < 0.5 else draw_color(rng)
    band = near(rng, outside, 4) if rng.random() < 0.35 else contrast(rng, outside, 25.0)
    shape = partial(
        containers.mug,
        diameter_m=span(rng, 0.066, 0.094),
        height_m=span(rng, 0.070, 0.108),
        wall_m=span(rng, 0.0034, 0.0050),
        handle_m=span(rng, 0.029, 0.041),
        outside=outside,
        inside=inside,
        band=band,
        seed=draw_seed(rng),
    )
    words = describe(
        "mug",
        "coffee mug",
        pick(rng, ("tea mug", "mug with a handle", "ceramic mug")),
        colors=color_names(outside),
        colored=bool(rng.random() < 0.6),
        category="cup",
        functions=("drink", *_HOLD),
    )
    return Draft(shape=shape, words=words, matter=_CERAMIC)


def bowl(rng: np.random.Generator) -> Draft:
    """Draw a bowl, a small bowl for dips, or a plate."""
    noun, others, diameters, height, foot = pick(
        rng,
        (
            ("bowl", ("cereal bowl", "soup bowl"), (0.120, 0.165), (0.33, 0.44), (0.44, 0.54)),
            ("bowl", ("salad bowl", "dish"), (0.135, 0.175), (0.30, 0.40), (0.44, 0.54)),
            ("small bowl", ("dip bowl", "ramekin"), (0.080, 0.110), (0.36, 0.48), (0.52, 0.64)),
            ("plate", ("dish", "dinner plate"), (0.150, 0.200), (0.11, 0.15), (0.60, 0.68)),
        ),
    )
    diameter = span(rng, *diameters)
    outside = draw_color(rng)
    inside = near(rng, outside) if rng.random() < 0.5 else draw_color(rng)
    shape = partial(
        containers.bowl,
        diameter_m=diameter,
        height_m=round(diameter * span(rng, *height, 3), 4),
        foot_m=round(diameter * span(rng, *foot, 3), 4),
        wall_m=span(rng, 0.0036, 0.0048),
        outside=outside,
        inside=inside,
        rim=near(rng, outside, 20) if rng.random() < 0.6 else contrast(rng, outside, 25.0),
        seed=draw_seed(rng),
    )
    # From above one sees a plate's inside, from the side a bowl's outside.
    seen = (inside, outside) if noun == "plate" else (outside, inside)
    words = describe(
        noun,
        *others,
        colors=color_names(*seen),
        colored=bool(rng.random() < 0.6),
        category="container",
        functions=_HOLD,
    )
    return Draft(shape=shape, words=words, matter=_CERAMIC)


# Noun, others, category, top widths (m), bottom over top, height over top, square, any colour.
_CUPS = (
    ("cup", ("tumbler", "beaker"), "cup", (0.064, 0.082), (0.68, 0.86), (1.05, 1.45), False),
    ("cup", ("drinking cup", "plastic cup"), "cup", (0.064, 0.082), (0.7, 0.9), (1.0, 1.3), False),
    (
        *("tub", ("plastic tub", "food container"), "container", (0.090, 0.130), (0.8, 0.9)),
        *((0.36, 0.55), True),
    ),
    (
        *("lunch box", ("plastic tub", "food box"), "container", (0.110, 0.150), (0.84, 0.94)),
        *((0.34, 0.46), True),
    ),
    (
        *("flower pot", ("plant pot", "planter"), "container", (0.070, 0.100), (0.62, 0.74)),
        *((0.82, 1.0), False),
    ),
    ("tin", ("open tin", "empty can"), "container", (0.062, 0.080), (1.0, 1.0), (0.7, 1.2), False),
    (
        *("pen cup", ("pencil holder", "desk cup"), "container", (0.060, 0.082), (0.92, 1.0)),
        *((1.15, 1.45), False),
    ),
)


def cup(rng: np.random.Generator) -> Draft:
    """Draw a cup, tub, lunch box, flower pot, open tin or pencil holder."""
    noun, others, category, tops, taper, rise, is_square = pick(rng, _CUPS)
    top = span(rng, *tops)
    palette = {"flower pot": ("orange", "brown", "white", "green"), "tin": ("gray",)}.get(noun, ())
    outside = draw_color(rng, *palette)
    matching = noun == "tin" or rng.random() < 0.5
    inside = near(rng, outside, 10) if matching else draw_color(rng)
    shape = partial(
        containers.cup,
        top_m=top,
        bottom_m=round(top * span(rng, *taper, 3), 4),
        height_m=round(top * span(rng, *rise, 3), 4),
        wall_m=span(rng, 0.0032, 0.0044),
        outside=outside,
        inside=inside,
        stripe=near(rng, outside, 8) if rng.random() < 0.4 else contrast(rng, outside, 20.0),
        squareness=span(rng, 4.5, 7.0, 2) if is_square else 2.0,
        aspect=span(rng, 0.62, 1.0, 3) if is_square else 1.0,
        seed=draw_seed(rng),
    )
    words = describe(
        noun,
        *others,
        colors=color_names(outside, inside),
        colored=bool(rng.random() < 0.6),
        category=category,
        functions=("drink", *_HOLD) if category == "cup" else _HOLD,
    )
    return Draft(shape=shape, words=words, matter=_PLASTIC)


def vase(rng: np.random.Generator) -> Draft:
    """Draw a round-bellied vase."""
    glaze, belly = draw_color(rng), span(rng, 0.066, 0.090)
    shape = partial(
        containers.vase,
        belly_m=belly,
        mouth_m=round(belly * span(rng, 0.68, 0.84, 3), 4),
        foot_m=round(belly * span(rng, 0.58, 0.70, 3), 4),
        height_m=round(belly * span(rng, 1.35, 1.85, 3), 4),
        wall_m=span(rng, 0.0036, 0.0046),
        glaze=glaze,
        foot=contrast(rng, glaze, 15.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "vase",
        "flower vase",
        "ceramic vase",
        colors=color_names(glaze),
        colored=bool(rng.random() < 0.5),
        category="container",
        functions=_HOLD,
    )
    return Draft(shape=shape, words=words, matter=_CERAMIC)


RECIPES: dict[str, Recipe] = {recipe.__name__: recipe for recipe in (mug, bowl, cup, vase)}
