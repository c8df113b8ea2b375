"""Variants are never an unseen object, nor nearly one."""

import dataclasses
from functools import partial

import numpy as np
import pytest

from models.errors import AssetError
from models.objects.asset import Shape
from models.objects.entries import SEEN, UNSEEN
from models.objects.variants import novelty, sampling
from models.objects.variants.draft import LEAST_SEED, Draft, is_color, parameters

CATALOGUE = (*SEEN, *UNSEEN)
every_unseen = pytest.mark.parametrize("entry", UNSEEN, ids=lambda entry: entry.name)


def scaled_geometry(shape: partial[Shape], factor: float) -> partial[Shape]:
    """Scale every length and share among a family's arguments, but nothing that is only painted."""

    def scale(value, key):
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            names = [field.name for field in dataclasses.fields(value)]
            return dataclasses.replace(value, **{n: scale(getattr(value, n), n) for n in names})
        if isinstance(value, float) and key not in novelty.PAINT_KEYS:
            return value * factor
        if isinstance(value, tuple) and not is_color(value) and key not in novelty.PAINT_KEYS:
            return tuple(scale(item, key) for item in value)
        return value

    return partial(shape.func, **{k: scale(v, k) for k, v in parameters(shape).items()})


@every_unseen
def test_unseen_objects_are_refused(entry):
    assert not novelty.is_novel(entry.shape)


@every_unseen
@pytest.mark.parametrize("factor", [0.975, 1.025])
def test_unseen_geometry_is_refused_nearby_whatever_its_paint(entry, factor):
    assert novelty.is_near(scaled_geometry(entry.shape, factor), entry.shape)


@every_unseen
def test_geometry_well_off_an_unseen_object_is_not_near_it(entry):
    assert not novelty.is_near(scaled_geometry(entry.shape, 1.08), entry.shape)


def test_no_draw_is_near_an_unseen_object(drafts):
    for draft in drafts:
        own = novelty.geometry(draft.shape)
        for entry in UNSEEN:
            if draft.shape.func is not entry.shape.func:
                continue
            other = novelty.geometry(entry.shape)
            if own.keys() == other.keys():
                differences = [
                    abs(own[k] - v) / max(abs(v), 0.001 if "_m" in k else 0.02)
                    for k, v in other.items()
                ]
                assert max(differences) > novelty.TOLERANCE, (draft.words, entry.name)


def test_no_draw_prints_a_title_of_an_unseen_object(drafts):
    barred = {"BLUE", "MOON", "MAGIC", "CLEAN", "REPEL", "LENT", "REPELLENT", "BLEACH"}
    barred |= {"GELATIN", "SUGAR", "SHAMPOO", "PERMANENT", "MARKER", "BLUEMOON", "ROSE"}
    assert barred <= novelty.reserved_words()
    printed = set().union(*(novelty.printed_words(draft.shape) for draft in drafts))
    assert len(printed) > 200
    assert not printed & novelty.reserved_words()


def test_a_draw_at_an_unseen_object_is_drawn_again():
    (bowl,) = (entry for entry in UNSEEN if entry.name == "yellow_bowl")
    painted = partial(bowl.shape.func, **{**bowl.shape.keywords, "outside": (20, 30, 200)})
    larger = partial(bowl.shape.func, **{**painted.keywords, "diameter_m": 0.16})
    shapes = iter([bowl.shape, painted, larger])

    def recipe(rng: np.random.Generator) -> Draft:
        return Draft(shape=next(shapes), words=bowl.words, matter=bowl.matter)

    assert sampling.draw_novel(np.random.default_rng(0), recipe).shape is larger


def test_a_recipe_without_anything_new_is_an_error():
    (bowl,) = (entry for entry in UNSEEN if entry.name == "yellow_bowl")

    def recipe(rng: np.random.Generator) -> Draft:
        return Draft(shape=bowl.shape, words=bowl.words, matter=bowl.matter)

    with pytest.raises(AssetError) as caught:
        sampling.draw_novel(np.random.default_rng(0), recipe)
    assert str(caught.value) == (
        "None of 200 variants of family 'bowl' differs enough from the unseen objects; "
        "widen the ranges of its recipe."
    )


def test_seeds_of_variants_and_catalogue_never_meet(drafts):
    for entry in CATALOGUE:
        assert parameters(entry.shape).get("seed", 0) < LEAST_SEED
    for draft in drafts:
        assert parameters(draft.shape).get("seed", LEAST_SEED) >= LEAST_SEED
