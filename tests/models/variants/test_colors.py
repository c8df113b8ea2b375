"""Names of colours, of paints and of the catalogue's entries."""

import numpy as np
import pytest

from models.objects.entries import SEEN, UNSEEN
from models.objects.variants.colors import ALL_COLORS, color_name, contrast, draw_color, lab
from models.objects.variants.draft import is_color, leaves, parameters
from models.objects.words import COLORS

CATALOGUE = (*SEEN, *UNSEEN)


@pytest.mark.parametrize(
    "entry", [e for e in CATALOGUE if e.words.colors], ids=lambda entry: entry.name
)
def test_first_colour_of_an_entry_is_among_the_names_of_its_paints(entry):
    paints = [value for _, value in leaves(parameters(entry.shape)) if is_color(value)]
    if not paints:  # A few families choose their paints themselves, as they do bare steel.
        assert entry.family == "puzzle_cube"
        return
    names = {color_name(paint) for paint in paints}
    assert entry.words.colors[0] in names | ({"gray"} if entry.family == "wrench" else set())


@pytest.mark.parametrize(
    ("rgb", "name"),
    [
        ((255, 0, 0), "red"),
        ((255, 255, 0), "yellow"),
        ((0, 255, 0), "green"),
        ((0, 0, 255), "blue"),
        ((255, 165, 0), "orange"),
        ((128, 0, 128), "purple"),
        ((255, 192, 203), "pink"),
        ((139, 69, 19), "brown"),
        ((0, 0, 0), "black"),
        ((255, 255, 255), "white"),
        ((128, 128, 128), "gray"),
        ((0, 128, 128), "green"),
        ((0, 0, 128), "blue"),
        ((128, 0, 0), "red"),
        ((245, 245, 220), "white"),
    ],
)
def test_css_colours_have_their_names(rgb, name):
    assert color_name(rgb) == name


def test_lightness_and_chroma_of_the_primaries_are_the_published_ones():
    # CIELAB of the sRGB primaries under D65: lightness, chroma, hue.
    assert lab((255, 0, 0)) == pytest.approx((53.24, 104.55, 40.0), abs=0.05)
    assert lab((0, 0, 255)) == pytest.approx((32.30, 133.81, 306.3), abs=0.05)
    assert lab((255, 255, 255)) == pytest.approx((100, 0, lab((255, 255, 255))[2]), abs=0.02)


def test_every_colour_has_a_name_of_the_vocabulary():
    steps = range(0, 256, 17)
    names = {color_name((r, g, b)) for r in steps for g in steps for b in steps}
    assert names == set(COLORS) == set(ALL_COLORS)


@pytest.mark.parametrize("name", ALL_COLORS)
def test_a_colour_drawn_by_name_goes_by_it(name):
    rng = np.random.default_rng(3)
    assert {color_name(draw_color(rng, name)) for _ in range(100)} == {name}


def test_contrast_ends_where_nothing_stands_out_enough():
    rng = np.random.default_rng(4)
    assert color_name(contrast(rng, (120, 120, 120), 80.0)) == "white"
    assert color_name(contrast(rng, (190, 190, 190), 80.0)) == "black"


def test_contrasting_ink_stands_out():
    rng = np.random.default_rng(4)
    for _ in range(100):
        ground = draw_color(rng)
        assert abs(lab(contrast(rng, ground, 38.0))[0] - lab(ground)[0]) >= 38.0
