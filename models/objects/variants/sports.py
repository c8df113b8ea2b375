"""Recipes for balls of sport, games and toy vehicles."""

from functools import partial
from typing import Literal

import numpy as np

from models.objects.asset import Matter
from models.objects.families import balls, games, vehicles
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
from models.objects.words import ObjectWords

_Range = tuple[float, float]
_PAINTS = (*BRIGHT_COLORS, "white", "black")
_SOLID_PLASTIC = Matter(density_kg_m3=950.0, source="moulded plastic")
_TOY_CAR = Matter(density_kg_m3=700.0, source="moulded plastic, partly hollow; assumed")


def _words(
    rng: np.random.Generator, *nouns: str, colors: tuple[str, ...], is_round: bool = False
) -> ObjectWords:
    """Word a toy."""
    return describe(
        *nouns,
        colors=colors,
        colored=bool(rng.random() < 0.5),
        category="toy",
        shapes=("round",) if is_round else (),
        functions=("play",),
    )


def seamed_ball(rng: np.random.Generator) -> Draft:
    """Draw a tennis ball, a baseball or a felt ball."""
    kind = pick(rng, ("tennis ball", "baseball", "felt ball"))
    skins: dict[str, tuple[Color, Color]] = {
        "tennis ball": ((214, 224, 56), (240, 240, 232)),
        "baseball": ((240, 236, 226), (196, 34, 40)),
    }
    skin = near(rng, skins[kind][0], 6) if kind in skins else draw_color(rng, *BRIGHT_COLORS)
    seam = near(rng, skins[kind][1], 8) if kind in skins else contrast(rng, skin)
    shape = partial(
        balls.seamed_ball,
        diameter_m=span(rng, 0.068, 0.078) if kind == "baseball" else span(rng, 0.058, 0.072),
        skin=skin,
        seam=seam,
        stitched=kind == "baseball",
        fuzz=span(rng, 0.05, 0.15, 2) if kind == "baseball" else span(rng, 0.6, 1.0, 2),
        seed=draw_seed(rng),
    )
    nouns = (kind, "ball", "small ball")
    words = _words(rng, *nouns, colors=color_names(skin), is_round=True)
    density = 700.0 if kind == "baseball" else 380.0
    matter = Matter(density_kg_m3=density, source="by the rules of the sport; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def golf_ball(rng: np.random.Generator) -> Draft:
    """Draw a golf ball, or a practice ball of another size."""
    color = draw_color(rng, "white", "white", "yellow", "orange", "pink", "green")
    shape = partial(
        balls.golf_ball,
        diameter_m=span(rng, 0.040, 0.054),
        color=color,
        num_dimples=int(rng.integers(240, 360)),
        seed=draw_seed(rng),
    )
    nouns = ("golf ball", "ball", "dimpled ball")
    words = _words(rng, *nouns, colors=color_names(color), is_round=True)
    matter = Matter(density_kg_m3=1100.0, source="rules of golf: 45.93 g, 42.67 mm")
    return Draft(shape=shape, words=words, matter=matter)


def brick(rng: np.random.Generator) -> Draft:
    """Draw a toy brick with studs."""
    color = draw_color(rng)
    studs = pick(rng, ((2, 2), (3, 2), (4, 2), (2, 1), (3, 1)))
    pitch = span(rng, 0.0165, 0.0215)
    shape = partial(
        games.brick,
        num_studs=studs,
        pitch_m=pitch,
        height_m=round(pitch * span(rng, 1.1, 1.4, 3), 4),
        color=color,
        seed=draw_seed(rng),
    )
    nouns = ("toy brick", "building brick", "plastic brick", "building block")
    words = _words(rng, *nouns, colors=color_names(color))
    matter = Matter(density_kg_m3=650.0, source="moulded plastic, hollow below; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def puzzle_cube(rng: np.random.Generator) -> Draft:
    """Draw a scrambled puzzle cube."""
    shape = partial(games.puzzle_cube, edge_m=span(rng, 0.042, 0.064), seed=draw_seed(rng))
    words = ObjectWords(
        label="puzzle cube",
        synonyms=("magic cube", "colorful cube", "cube puzzle", "toy cube"),
        category="toy",
        colors=("black",),
        functions=("play",),
    )
    return Draft(shape=shape, words=words, matter=Matter(density_kg_m3=540.0, source="assumed"))


def die(rng: np.random.Generator) -> Draft:
    """Draw a large die."""
    color = draw_color(rng)
    shape = partial(
        games.die,
        edge_m=span(rng, 0.024, 0.050),
        color=color,
        pips=contrast(rng, color),
        seed=draw_seed(rng),
    )
    words = _words(rng, "dice", "die", "big dice", "cube with dots", colors=color_names(color))
    return Draft(shape=shape, words=words, matter=_SOLID_PLASTIC)


def ring(rng: np.random.Generator) -> Draft:
    """Draw a rubber ring with stripes."""
    color = draw_color(rng)
    stripe = near(rng, color, 6) if rng.random() < 0.4 else contrast(rng, color, 20.0)
    outer = span(rng, 0.070, 0.115)
    shape = partial(
        games.ring,
        outer_m=outer,
        tube_m=round(outer * span(rng, 0.18, 0.25, 3), 4),
        color=color,
        stripe=stripe,
        seed=draw_seed(rng),
    )
    nouns = ("toy ring", "rubber ring", "ring", "throwing ring")
    words = _words(rng, *nouns, colors=color_names(color, stripe), is_round=True)
    return Draft(shape=shape, words=words, matter=_SOLID_PLASTIC)


def pawn(rng: np.random.Generator) -> Draft:
    """Draw a large pawn."""
    color, base = draw_color(rng), span(rng, 0.030, 0.044)
    shape = partial(
        games.pawn,
        height_m=round(base * span(rng, 1.7, 2.1, 3), 4),
        base_m=base,
        color=color,
        seed=draw_seed(rng),
    )
    words = _words(rng, "pawn", "chess pawn", "game piece", colors=color_names(color))
    return Draft(shape=shape, words=words, matter=Matter(density_kg_m3=700.0, source="beech wood"))


def nut(rng: np.random.Generator) -> Draft:
    """Draw a toy nut."""
    color, width = draw_color(rng), span(rng, 0.036, 0.060)
    shape = partial(
        games.nut,
        width_m=width,
        hole_m=round(width * span(rng, 0.46, 0.58, 3), 4),
        height_m=round(width * span(rng, 0.36, 0.55, 3), 4),
        color=color,
        seed=draw_seed(rng),
    )
    nouns = ("toy nut", "hexagonal nut", "plastic nut")
    words = _words(rng, *nouns, colors=color_names(color))
    return Draft(shape=shape, words=words, matter=_SOLID_PLASTIC)


# Noun, others, side view, length (m), width and height over length, print.
_CARS: tuple[
    tuple[
        str,
        tuple[str, ...],
        Literal["car", "bus"],
        _Range,
        _Range,
        _Range,
        tuple[str, ...],
    ],
    ...,
] = (
    (
        *("toy car", ("car", "model car"), "car", (0.075, 0.110), (0.42, 0.50), (0.36, 0.44)),
        *(("7", "GO", "RACE", "POLICE", "8"),),
    ),
    (
        *("toy taxi", ("taxi", "toy car"), "car", (0.075, 0.105), (0.42, 0.50), (0.36, 0.44)),
        *(("TAXI",),),
    ),
    (
        *("toy bus", ("bus", "model bus"), "bus", (0.090, 0.130), (0.34, 0.42), (0.40, 0.48)),
        *(("CITY", "SCHOOL", "TOUR", "LINE 5"),),
    ),
    (
        *("toy van", ("van", "delivery van"), "bus", (0.080, 0.105), (0.42, 0.48), (0.46, 0.54)),
        *(("POST", "FRESH", "EXPRESS"),),
    ),
)


def car(rng: np.random.Generator) -> Draft:
    """Draw a toy car, taxi, bus or van."""
    noun, others, kind, lengths, wide, high, prints = pick(rng, _CARS)
    color = draw_color(rng, "yellow") if noun == "toy taxi" else draw_color(rng, *_PAINTS)
    length = span(rng, *lengths)
    shape = partial(
        vehicles.car,
        kind=kind,
        size_m=(
            length,
            round(length * span(rng, *wide, 3), 4),
            round(length * span(rng, *high, 3), 4),
        ),
        color=color,
        stripe=contrast(rng, color, 20.0),
        words=pick(rng, tuple(filter(may_print, prints)) or ("1",)),
        seed=draw_seed(rng),
    )
    words = _words(rng, noun, *others, "toy vehicle", colors=color_names(color))
    return Draft(shape=shape, words=words, matter=_TOY_CAR)


def boat(rng: np.random.Generator) -> Draft:
    """Draw a toy boat."""
    hull = draw_color(rng, *_PAINTS)
    length = span(rng, 0.095, 0.140)
    shape = partial(
        vehicles.boat,
        length_m=length,
        beam_m=round(length * span(rng, 0.38, 0.48, 3), 4),
        hull=hull,
        deck=contrast(rng, hull, 15.0),
        cabin=draw_color(rng, "white", *BRIGHT_COLORS),
        seed=draw_seed(rng),
    )
    nouns = ("toy boat", "boat", "toy ship", "model boat")
    words = _words(rng, *nouns, colors=color_names(hull))
    return Draft(shape=shape, words=words, matter=_TOY_CAR)


def locomotive(rng: np.random.Generator) -> Draft:
    """Draw a toy steam locomotive."""
    boiler = draw_color(rng, *_PAINTS)
    cab = near(rng, boiler) if rng.random() < 0.4 else draw_color(rng, *BRIGHT_COLORS)
    length = span(rng, 0.095, 0.130)
    shape = partial(
        vehicles.locomotive,
        length_m=length,
        width_m=round(length * span(rng, 0.38, 0.46, 3), 4),
        boiler=boiler,
        cab=cab,
        trim=draw_color(rng, "black", "red", "gray"),
        seed=draw_seed(rng),
    )
    nouns = ("toy train", "toy locomotive", "train engine", "train")
    words = _words(rng, *nouns, colors=color_names(boiler, cab))
    return Draft(shape=shape, words=words, matter=_TOY_CAR)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe
    for recipe in (seamed_ball, golf_ball, brick, puzzle_cube, die, ring, pawn, nut)
} | {"car": car, "boat": boat, "locomotive": locomotive}
