"""Words of variants: rich, true, and of the vocabulary."""

import numpy as np
import pytest

from models.objects.variants import sampling, vocabulary
from models.objects.variants.draft import Draft, describe, parameters
from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES


def test_words_are_rich_and_in_the_vocabulary(drafts):
    for draft in drafts:
        words = draft.words
        assert words.label and words.label == words.label.strip().lower()
        assert 3 <= len(words.synonyms) <= 8, words
        assert len({words.label, *words.synonyms}) == 1 + len(words.synonyms)
        assert words.category is None or words.category in CATEGORIES
        assert 1 <= len(words.colors) <= 3 and set(words.colors) <= set(COLORS)
        assert set(words.shapes) <= set(SHAPES)
        assert set(words.functions) <= set(FUNCTIONS)


def test_labels_are_many_and_name_true_colours(drafts):
    labels = {draft.words.label for draft in drafts}
    assert len(labels) > 350
    for draft in drafts:
        named = set((draft.words.label or "").split()) & set(COLORS) - {"orange"}
        assert named <= set(draft.words.colors), draft.words


@pytest.mark.parametrize(
    ("noun", "others", "colors", "colored", "label", "synonyms"),
    [
        (
            "mug",
            ("coffee mug",),
            ("red", "white"),
            True,
            "red mug",
            ("mug", "coffee mug", "red and white mug", "red coffee mug", "red object"),
        ),
        (
            "orange juice carton",
            ("juice",),
            ("orange",),
            True,
            "orange juice carton",
            ("juice", "orange juice", "orange object"),
        ),
    ],
)
def test_describe_puts_colour_before_nouns(noun, others, colors, colored, label, synonyms):
    words = describe(noun, *others, colors=colors, colored=colored)
    assert (words.label, words.synonyms) == (label, synonyms)


def test_vocabulary_has_many_products_each_printed_once():
    products = [p for vessel in vocabulary.VESSELS for p in vocabulary.products(vessel)]
    assert len({product.title for product in products}) >= 60
    assert len({product.noun for product in products}) >= 60
    for vessel in vocabulary.VESSELS:
        titles = [product.title for product in vocabulary.products(vessel)]
        assert len(titles) == len(set(titles)) >= 3, vessel


def test_titles_name_what_the_words_say(drafts):
    nouns: dict[str, set[str]] = {}
    for vessel in vocabulary.VESSELS:
        for product in vocabulary.products(vessel):
            nouns.setdefault(product.title.replace("\n", " "), set()).add(product.noun)
    printed = [(d, t) for d in drafts if (t := _title(d)) is not None]
    assert len({title for _, title in printed}) >= 60
    for draft, title in printed:
        assert any(noun in draft.words.title for noun in nouns[title]), (title, draft.words)


def _title(draft: Draft) -> str | None:
    given = parameters(draft.shape)
    title = given["label"].title if "label" in given else given.get("title")
    return None if title is None else title.replace("\n", " ")


@pytest.mark.parametrize(
    ("family", "least"),
    [
        ("mug", set(COLORS)),
        ("bowl", set(COLORS)),
        ("cup", set(COLORS)),
        ("apple", {"red", "green", "yellow"}),
        ("citrus", {"orange", "yellow", "green"}),
        ("bottle", set(COLORS)),
    ],
)
def test_families_come_in_all_their_colours(family, least):
    rng = np.random.default_rng(5)
    drawn = {sampling.draw(rng, family=family).words.colors[0] for _ in range(300)}
    assert drawn >= least


def test_fruit_has_natural_colours_only(drafts):
    for draft in drafts:
        if draft.words.category == "fruit":
            assert not set(draft.words.colors) & {"blue", "pink", "black", "gray", "white"}
