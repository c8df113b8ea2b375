"""Recipes for what is bought in packages: cans, cartons, bottles, tubes and spray cans."""

from functools import partial

import numpy as np

from models.objects.asset import Matter
from models.objects.families import bottles, packages
from models.objects.variants.colors import color_names, contrast, draw_color
from models.objects.variants.draft import Draft, Recipe, describe, draw_seed, pick, span
from models.objects.variants.vocabulary import Product, products
from models.objects.words import ObjectWords

_Range = tuple[float, float]
_PICTURES = ("disc", "band", "rays")
_EMBLEMS = ("drop", "wave", "leaf", "circle")
_FILLED = Matter(
    density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
)


def product_words(
    rng: np.random.Generator,
    product: Product,
    vessel: str,
    *others: str,
    colors: tuple[str, ...],
) -> ObjectWords:
    """Word a packaged product: "corn can", "can of corn", and what else it goes by.

    Args:
        rng: Decides whether the label starts with the colour.
        product: What is inside.
        vessel: "can", "box", "bottle", ...
        others: Further noun phrases.
        colors: Names of its colours, most dominant first.

    Returns:
        The words.
    """
    return describe(
        f"{product.noun} {vessel}",
        f"{vessel} of {product.content}",
        *others,
        colors=colors,
        colored=bool(rng.random() < 0.25),
        functions=() if product.function is None else (product.function,),
    )


def can(rng: np.random.Generator) -> Draft:
    """Draw a food can, high or flat."""
    kind, diameter, height, others = pick(
        rng,
        (
            ("can", (0.058, 0.078), (0.085, 0.120), ("food can", "canned food")),
            ("can", (0.058, 0.078), (0.085, 0.120), ("tin", "food tin")),
            ("flat can", (0.074, 0.086), (0.034, 0.050), ("flat can", "small tin")),
        ),
    )
    product = pick(rng, products(kind))
    top, bottom = draw_color(rng), draw_color(rng)
    shape = partial(
        packages.can,
        diameter_m=span(rng, *diameter),
        height_m=span(rng, *height),
        title=product.title,
        subtitle=product.note,
        top=top,
        bottom=bottom,
        ink=contrast(rng, top),
        accent=contrast(rng, bottom, 25.0),
        seed=draw_seed(rng),
    )
    words = product_words(rng, product, "can", *others, colors=color_names(top, bottom))
    return Draft(shape=shape, words=words, matter=Matter(density_kg_m3=1020.0, source="full can"))


def carton(rng: np.random.Generator) -> Draft:
    """Draw a carton: upright, lying flat, or about cubic."""
    product = pick(rng, products("carton"))
    w, d, h = pick(
        rng,
        (
            ((0.055, 0.120), (0.030, 0.070), (0.090, 0.200)),
            ((0.120, 0.180), (0.040, 0.075), (0.030, 0.050)),
            ((0.060, 0.080), (0.055, 0.080), (0.060, 0.085)),
            ((0.070, 0.110), (0.022, 0.035), (0.060, 0.085)),
        ),
    )
    ground = draw_color(rng)
    shape = partial(
        packages.carton,
        size_m=(span(rng, *w), span(rng, *d), span(rng, *h)),
        title=product.title,
        subtitle=product.note,
        ground=ground,
        ink=contrast(rng, ground),
        accent=contrast(rng, ground, 20.0),
        picture=pick(rng, _PICTURES),
        seed=draw_seed(rng),
    )
    words = product_words(
        rng, product, "box", product.content, "carton", colors=color_names(ground)
    )
    density = {"clean": 550.0, "eat": 350.0}.get(product.function or "", 400.0)
    matter = Matter(density_kg_m3=density, source="contents with air between; assumed")
    return Draft(shape=shape, words=words, matter=matter)


def _label(rng: np.random.Generator, product: Product, *, is_tube: bool = False) -> bottles.Label:
    """Draw a printed label; every third is printed on the plastic itself."""
    body = draw_color(rng)
    paper = body if rng.random() < 0.35 else draw_color(rng)
    return bottles.Label(
        title=product.title,
        subtitle=product.note,
        body=body,
        paper=paper,
        ink=contrast(rng, paper),
        accent=contrast(rng, paper, 22.0),
        span=(
            span(rng, 0.08, 0.16, 3),
            span(rng, 0.76, 0.88, 3) if is_tube else span(rng, 0.64, 0.74, 3),
        ),
        emblem=pick(rng, _EMBLEMS),
    )


# Kind of bottle: widths, depth over width, heights (m), squareness, caps, waist up to.
_BOTTLES: tuple[tuple[str, _Range, _Range, _Range, tuple[bottles.CapKind, ...], float], ...] = (
    ("care bottle", (0.052, 0.072), (0.58, 0.75), (0.14, 0.21), ("flip", "screw", "pump"), 0.07),
    ("cleaner bottle", (0.064, 0.082), (0.58, 0.72), (0.19, 0.25), ("trigger", "screw"), 0.04),
    ("drink bottle", (0.056, 0.072), (1.0, 1.0), (0.16, 0.23), ("screw",), 0.06),
    ("sauce bottle", (0.050, 0.068), (0.7, 1.0), (0.14, 0.21), ("flip", "screw"), 0.05),
    ("small bottle", (0.042, 0.056), (0.8, 1.0), (0.09, 0.14), ("screw", "flip"), 0.0),
)


def bottle(rng: np.random.Generator) -> Draft:
    """Draw a bottle for care, cleaning, drinks, sauces, or a small one."""
    kind, widths, aspects, heights, caps, waist = pick(rng, _BOTTLES)
    product = pick(rng, products(kind))
    width, aspect = span(rng, *widths), span(rng, *aspects, 3)
    is_round = kind == "drink bottle" or (kind == "small bottle" and rng.random() < 0.5)
    depth = width if is_round else round(width * aspect, 4)
    label, cap = _label(rng, product), pick(rng, caps)
    shape = partial(
        bottles.bottle,
        width_m=width,
        depth_m=depth,
        height_m=span(rng, *heights),
        shoulder=span(rng, 0.64, 0.88, 3),
        neck_m=min(span(rng, 0.022, 0.036), round(0.72 * depth, 4)),
        cap=cap,
        cap_color=draw_color(rng),
        label=label,
        squareness=2.0 if is_round else span(rng, 2.0, 4.0, 2),
        waist=span(rng, 0.0, waist, 3) if cap != "trigger" else 0.0,
    )
    others = {
        "trigger": ("spray bottle", "trigger bottle"),
        "pump": ("pump bottle", "dispenser"),
    }.get(cap, ("plastic bottle",))
    words = product_words(
        rng,
        product,
        "bottle",
        product.content,
        *others,
        colors=color_names(label.body, label.paper),
    )
    return Draft(shape=shape, words=words, matter=_FILLED)


def tube(rng: np.random.Generator) -> Draft:
    """Draw a squeeze tube standing on its cap."""
    product, diameter = pick(rng, products("tube")), span(rng, 0.030, 0.048)
    label = _label(rng, product, is_tube=True)
    shape = partial(
        bottles.tube,
        diameter_m=diameter,
        width_m=round(diameter * span(rng, 1.06, 1.45, 3), 4),
        height_m=span(rng, 0.105, 0.180),
        cap_color=draw_color(rng),
        label=label,
    )
    words = product_words(
        rng,
        product,
        "tube",
        product.content,
        "squeeze tube",
        colors=color_names(label.body, label.paper),
    )
    return Draft(shape=shape, words=words, matter=_FILLED)


def spray_can(rng: np.random.Generator) -> Draft:
    """Draw an aerosol can."""
    product = pick(rng, products("spray can"))
    label = _label(rng, product, is_tube=True)
    shape = partial(
        bottles.spray_can,
        diameter_m=span(rng, 0.040, 0.064),
        height_m=span(rng, 0.130, 0.215),
        cap_color=draw_color(rng),
        label=label,
    )
    others = (product.content, "spray can", "aerosol can")
    words = product_words(rng, product, "can", *others, colors=color_names(label.body, label.paper))
    matter = Matter(density_kg_m3=550.0, source="aerosol, partly gas; assumed")
    return Draft(shape=shape, words=words, matter=matter)


RECIPES: dict[str, Recipe] = {
    recipe.__name__: recipe for recipe in (can, carton, bottle, tube, spray_can)
}
