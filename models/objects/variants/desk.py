"""Recipes for things of desk, pocket and sink."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import cleaning, desk
from models.objects.paint import Color
from models.objects.variants.colors import color_names, contrast, draw_color, near
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span

_LEATHER = ("brown", "brown", "black", "red", "blue", "green")
_WOODS: tuple[Color, ...] = ((206, 160, 104), (160, 110, 66), (226, 192, 140))


def telephone(rng: np.random.Generator) -> Draft:
    """Draw a smart telephone lying on its back."""
    frame = draw_color(rng, "black", "black", "white", "red", "blue", "pink", "green")
    screen = draw_color(rng, "blue", "purple", "green", "black", "pink")
    length = span(rng, 0.130, 0.165)
    shape = partial(
        desk.telephone,
        size_m=(length, round(length * span(rng, 0.45, 0.52, 3), 4), span(rng, 0.0100, 0.0125)),
        frame=frame,
        screen=screen,
        seed=draw_seed(rng),
    )
    nouns = ("phone", "smartphone", "mobile phone", "telephone", "cell phone")
    words = describe(*nouns, colors=color_names(screen, frame))
    matter = Matter(mass_kg=0.175, source="smart telephone; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def calculator(rng: np.random.Generator) -> Draft:
    """Draw a pocket calculator."""
    color = draw_color(rng)
    length = span(rng, 0.108, 0.150)
    shape = partial(
        desk.calculator,
        size_m=(length, round(length * span(rng, 0.52, 0.64, 3), 4), span(rng, 0.0115, 0.0180)),
        color=color,
        key=contrast(rng, color),
        seed=draw_seed(rng),
    )
    words = describe(
        "calculator",
        "pocket calculator",
        "desk calculator",
        colors=color_names(color),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(mass_kg=0.110, source="pocket calculator; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def camera(rng: np.random.Generator) -> Draft:
    """Draw a compact camera."""
    body = draw_color(rng, "black", "black", "brown", "red", "blue", "green", "pink")
    shape = partial(
        desk.camera,
        size_m=(span(rng, 0.088, 0.112), span(rng, 0.027, 0.038), span(rng, 0.056, 0.070)),
        body=body,
        trim=contrast(rng, body, 30.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "camera",
        "photo camera",
        "compact camera",
        colors=color_names(body),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=1000.0, source="compact camera; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def glasses_case(rng: np.random.Generator) -> Draft:
    """Draw a closed case for glasses."""
    color = draw_color(rng, *_LEATHER)
    shape = partial(
        desk.glasses_case,
        size_m=(span(rng, 0.140, 0.172), span(rng, 0.052, 0.068), span(rng, 0.032, 0.046)),
        color=color,
        lining=contrast(rng, color, 25.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "glasses case",
        "spectacle case",
        "leather case",
        colors=color_names(color),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(density_kg_m3=320.0, source="hollow case with glasses; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def candle(rng: np.random.Generator) -> Draft:
    """Draw a pillar candle."""
    wax = draw_color(rng)
    shape = partial(
        desk.candle,
        diameter_m=span(rng, 0.042, 0.074),
        height_m=span(rng, 0.065, 0.135),
        wax=wax,
        band=near(rng, wax, 14) if rng.random() < 0.4 else contrast(rng, wax, 15.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "candle",
        "wax candle",
        "pillar candle",
        colors=color_names(wax),
        colored=bool(rng.random() < 0.5),
    )
    return Draft(shape=shape, words=words, matter=Matter(density_kg_m3=900.0, source="paraffin"))


def stapler(rng: np.random.Generator) -> Draft:
    """Draw a desk stapler."""
    color = draw_color(rng)
    length = span(rng, 0.105, 0.155)
    shape = partial(
        desk.stapler,
        length_m=length,
        width_m=round(length * span(rng, 0.25, 0.30, 3), 4),
        height_m=round(length * span(rng, 0.36, 0.44, 3), 4),
        color=color,
        seed=draw_seed(rng),
    )
    words = describe(
        "stapler",
        "desk stapler",
        "office stapler",
        colors=color_names(color),
        colored=bool(rng.random() < 0.4),
    )
    matter = Matter(density_kg_m3=1300.0, source="sheet steel and plastic; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def sponge(rng: np.random.Generator) -> Draft:
    """Draw a kitchen sponge with a scouring pad."""
    foam = draw_color(rng, "yellow", "orange", "pink", "blue", "green", "purple")
    pad = draw_color(rng, "green", "blue", "gray", "red", "white", "black")
    shape = partial(
        cleaning.sponge,
        size_m=(span(rng, 0.085, 0.122), span(rng, 0.056, 0.076), span(rng, 0.024, 0.040)),
        foam=foam,
        pad=pad,
        seed=draw_seed(rng),
    )
    words = describe(
        "sponge",
        "kitchen sponge",
        "scouring sponge",
        colors=color_names(foam, pad),
        colored=bool(rng.random() < 0.3),
        functions=("clean",),
    )
    return Draft(shape=shape, words=words, matter=Matter(density_kg_m3=130.0, source="damp foam"))


def brush(rng: np.random.Generator) -> Draft:
    """Draw a scrubbing brush standing on its bristles."""
    back = near(rng, pick(rng, _WOODS)) if rng.random() < 0.5 else draw_color(rng)
    length = span(rng, 0.165, 0.225)
    shape = partial(
        cleaning.brush,
        length_m=length,
        head_m=(round(length * span(rng, 0.43, 0.50, 3), 4), span(rng, 0.043, 0.058)),
        height_m=span(rng, 0.038, 0.052),
        back=back,
        bristle=contrast(rng, back, 15.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "brush",
        "scrubbing brush",
        "cleaning brush",
        colors=color_names(back),
        colored=bool(rng.random() < 0.3),
        functions=("clean",),
    )
    matter = Matter(density_kg_m3=500.0, source="beech wood and bristles; assumed")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe
    for recipe in (telephone, calculator, camera, glasses_case, candle, stapler, sponge, brush)
}
