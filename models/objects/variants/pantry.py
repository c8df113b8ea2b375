"""Recipes for groceries that are neither plain cans nor plain cartons."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import groceries
from models.objects.variants.colors import color_names, contrast, draw_color
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.variants.goods import product_words
from models.objects.variants.vocabulary import products


def drink_can(rng: np.random.Generator) -> Draft:
    """Draw a drink can."""
    product, color = pick(rng, products("drink can")), draw_color(rng)
    shape = partial(
        groceries.drink_can,
        diameter_m=span(rng, 0.053, 0.067),
        height_m=span(rng, 0.095, 0.140),
        title=product.title.replace("\n", " "),
        color=color,
        swoosh=contrast(rng, color, 20.0),
        seed=draw_seed(rng),
    )
    words = product_words(
        rng, product, "can", product.content, "drink can", colors=color_names(color)
    )
    return Draft(shape=shape, words=words, matter=Matter(density_kg_m3=1000.0, source="full can"))


def jar(rng: np.random.Generator) -> Draft:
    """Draw a jar with a screw lid."""
    product = pick(rng, products("jar"))
    content = draw_color(rng, "red", "brown", "yellow", "orange", "green", "purple")
    paper = draw_color(rng, "white", "white", "yellow", "pink")
    lid_color = contrast(rng, paper, 45.0)
    shape = partial(
        groceries.jar,
        diameter_m=span(rng, 0.054, 0.078),
        height_m=span(rng, 0.072, 0.125),
        content=content,
        lid=lid_color,
        paper=paper,
        title=product.title,
        seed=draw_seed(rng),
    )
    colors = color_names(paper, content, lid_color)
    words = product_words(rng, product, "jar", product.content, "glass jar", colors=colors)
    matter = Matter(density_kg_m3=1200.0, source="food in glass; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def gable_carton(rng: np.random.Generator) -> Draft:
    """Draw a drink carton with a gable top."""
    product = pick(rng, products("drink carton"))
    color = draw_color(rng, "blue", "green", "red", "orange", "yellow", "purple", "pink", "brown")
    edge = span(rng, 0.050, 0.072)
    shape = partial(
        groceries.gable_carton,
        edge_m=edge,
        height_m=round(edge * span(rng, 1.9, 2.7, 3), 4),
        title=product.title,
        subtitle=product.note,
        color=color,
        ink=contrast(rng, (244, 243, 238), 40.0),
        seed=draw_seed(rng),
    )
    words = product_words(
        rng, product, "carton", product.content, "carton", colors=(*color_names(color), "white")
    )
    matter = Matter(density_kg_m3=1000.0, source="filled with a drink; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def tissue_box(rng: np.random.Generator) -> Draft:
    """Draw a box of tissues, one standing out."""
    color = draw_color(rng)
    shape = partial(
        groceries.tissue_box,
        size_m=(span(rng, 0.090, 0.125), span(rng, 0.056, 0.076), span(rng, 0.042, 0.066)),
        color=color,
        dots=contrast(rng, color, 15.0),
        seed=draw_seed(rng),
    )
    words = describe(
        "tissue box",
        "box of tissues",
        "tissues",
        colors=color_names(color),
        colored=bool(rng.random() < 0.3),
        functions=("clean",),
    )
    matter = Matter(density_kg_m3=180.0, source="tissues, loosely folded; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def lid(rng: np.random.Generator) -> Draft:
    """Draw the lid of a pitcher or pot."""
    color, diameter = draw_color(rng), span(rng, 0.076, 0.115)
    shape = partial(
        groceries.lid,
        diameter_m=diameter,
        height_m=round(diameter * span(rng, 0.34, 0.44, 3), 4),
        color=color,
        seed=draw_seed(rng),
    )
    words = describe(
        "lid",
        "pot lid",
        "plastic lid",
        "cover",
        colors=color_names(color),
        colored=bool(rng.random() < 0.5),
        shapes=("round",),
    )
    matter = Matter(density_kg_m3=500.0, source="polypropylene, hollow below; assumed")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe for recipe in (drink_can, jar, gable_carton, tissue_box, lid)
}
