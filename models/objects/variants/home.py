"""Recipes for small things about the house."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import household
from models.objects.variants.colors import color_names, contrast, draw_color, near
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.variants.novelty import may_print

_PLASTIC = Matter(density_kg_m3=1050.0, source="polystyrene")
_HOLD = ("hold other things",)


_STAMPS = ("SOAP", "CARE", "FRESH", "PURE", "OLIVE", "BATH", "HONEY", "MINT", "ALOE", "MILK")


def soap(rng: np.random.Generator) -> Draft:
    """Draw a bar of soap with a stamped word."""
    color = draw_color(rng, "white", "green", "pink", "yellow", "orange", "blue", "purple", "brown")
    shape = partial(
        household.soap,
        size_m=(span(rng, 0.070, 0.098), span(rng, 0.046, 0.064), span(rng, 0.022, 0.032)),
        color=color,
        words=pick(rng, tuple(filter(may_print, _STAMPS))),
        seed=draw_seed(rng),
    )
    words = describe(
        "bar of soap",
        "soap",
        "soap bar",
        colors=color_names(color),
        colored=False,
        functions=("clean",),
    )
    matter = Matter(density_kg_m3=1050.0, source="toilet soap; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def soap_dish(rng: np.random.Generator) -> Draft:
    """Draw a shallow dish with drain grooves."""
    color = draw_color(rng)
    length = span(rng, 0.098, 0.140)
    shape = partial(
        household.soap_dish,
        size_m=(length, round(length * span(rng, 0.62, 0.80, 3), 4), span(rng, 0.020, 0.032)),
        wall_m=span(rng, 0.0036, 0.0048),
        color=color,
        groove=contrast(rng, color, 14.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "soap dish",
        "soap tray",
        "shallow dish",
        colors=color_names(color),
        colored=bool(rng.random() < 0.5),
        category="container",
        functions=_HOLD,
    )
    return Draft(shape=shape, words=words, matter=_PLASTIC)


def computer_mouse(rng: np.random.Generator) -> Draft:
    """Draw a computer mouse."""
    color = draw_color(rng, "black", "white", "gray", "red", "blue", "pink", "green")
    shape = partial(
        household.computer_mouse,
        length_m=span(rng, 0.088, 0.118),
        color=color,
        wheel=contrast(rng, color),
    )
    words = describe(
        "computer mouse",
        "mouse",
        "wireless mouse",
        colors=color_names(color),
        colored=bool(rng.random() < 0.4),
    )
    matter = Matter(mass_kg=0.085, source="office mouse; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def remote_control(rng: np.random.Generator) -> Draft:
    """Draw a remote control lying on its back."""
    color = draw_color(rng, "black", "black", "gray", "blue", "brown")
    shape = partial(
        household.remote_control,
        size_m=(span(rng, 0.125, 0.195), span(rng, 0.036, 0.054), span(rng, 0.015, 0.024)),
        color=color,
        seed=draw_seed(rng),
    )
    words = describe(
        "remote control",
        "remote",
        "tv remote",
        colors=color_names(color),
        colored=bool(rng.random() < 0.3),
    )
    matter = Matter(mass_kg=0.11, source="with two AAA cells; assumed")
    return Draft(shape=shape, words=words, matter=matter)


_TAPES = (
    ("duct tape", (0.085, 0.108), (0.62, 0.72), (0.036, 0.050), ("gray", "black", "white")),
    ("packing tape", (0.080, 0.104), (0.70, 0.80), (0.036, 0.050), ("brown",)),
    ("masking tape", (0.078, 0.105), (0.66, 0.76), (0.018, 0.032), ("yellow", "white", "blue")),
    ("electrical tape", (0.055, 0.070), (0.48, 0.60), (0.016, 0.020), ()),
    ("sticky tape", (0.060, 0.085), (0.55, 0.70), (0.016, 0.026), ()),
)


def tape_roll(rng: np.random.Generator) -> Draft:
    """Draw a roll of tape lying flat."""
    noun, outers, hole, widths, palette = pick(rng, _TAPES)
    outer = span(rng, *outers)
    tape = draw_color(rng, *palette)
    shape = partial(
        household.tape_roll,
        outer_m=outer,
        inner_m=round(outer * span(rng, *hole, 3), 4),
        width_m=span(rng, *widths),
        tape=tape,
        core=near(rng, pick(rng, ((196, 160, 112), (236, 236, 230), (60, 60, 64)))),
        seed=draw_seed(rng),
    )
    words = describe(
        noun,
        "roll of tape",
        "tape",
        "adhesive tape",
        colors=color_names(tape),
        colored=bool(rng.random() < 0.4),
        shapes=("round",),
    )
    matter = Matter(density_kg_m3=950.0, source="polypropylene film; assumed")
    return Draft(shape=shape, words=words, matter=matter)


_BARRELS = ("INK", "BOLD", "FINE", "WRITER", "COLOR", "JUMBO", "SKETCH", "OFFICE")


def marker(rng: np.random.Generator) -> Draft:
    """Draw a felt marker lying on its side."""
    color = draw_color(rng)
    shape = partial(
        household.marker,
        diameter_m=span(rng, 0.0155, 0.0225),
        length_m=span(rng, 0.108, 0.152),
        color=color,
        words=pick(rng, tuple(filter(may_print, _BARRELS))),
    )
    words = describe(
        "marker",
        "felt pen",
        "marker pen",
        "pen",
        colors=color_names(color),
        colored=bool(rng.random() < 0.6),
    )
    matter = Matter(density_kg_m3=560.0, source="YCB 040: published mass over volume")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe
    for recipe in (soap, soap_dish, computer_mouse, remote_control, tape_roll, marker)
}
