"""What people may say of an object: phrases by concept, and which concepts hold for what."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.objects.words import CATEGORIES, COLORS, ObjectWords
from perception.encoders.embedded import EmbeddedEncoder

# A colour that an eye may take for another: asked for the one, the other is no clear mistake.
_NEAR_COLORS = (
    *(("red", "orange"), ("red", "pink"), ("yellow", "orange"), ("brown", "orange")),
    *(("pink", "purple"), ("blue", "purple"), ("gray", "black"), ("gray", "white")),
    *(("green", "yellow"), ("brown", "red"), ("brown", "yellow")),
)
_ADJECTIVE_PHRASES = ("{} object", "{} thing", "something {}", "{} item", "object that is {}")
_FUNCTION_PHRASES = {
    "eat": (
        *("something to eat", "something edible", "food", "a snack", "food to eat"),
        *("something i can eat", "groceries", "an edible thing", "i feel hungry"),
    ),
    "drink": (
        *("something to drink", "something to drink from", "a drink", "a beverage", "drinks"),
        *("something i can drink", "i feel thirsty", "what people drink from"),
    ),
    "play": (
        *("something to play", "something to play with", "a plaything", "something fun"),
        *("something for children to play with", "a game", "something a child would like"),
    ),
    "hold other things": (
        *("something to hold other things", "something to hold things", "a vessel"),
        *("something to put things in", "something i can put things into", "a holder"),
        *("something to keep small things in", "a receptacle"),
    ),
    "clean": (
        *("something to clean", "something to clean with", "cleaning product", "toiletries"),
        *("something to wash with", "a cleaner", "something for washing", "hygiene product"),
    ),
}
_CATEGORY_PHRASES = {
    "fruit": ("fruit", "a piece of fruit", "some fruit", "fruits", "fresh fruit"),
    "container": ("container", "a container", "open container", "dish or bowl"),
    "toy": ("toy", "a toy", "toys", "some toy", "children's toy"),
    "cup": ("cup", "a cup", "cups", "drinking cup", "mug or cup"),
    "sugar": ("sugar", "some sugar"),
}
_ROUND_PHRASES = (
    *(p.format("round") for p in _ADJECTIVE_PHRASES),
    *("spherical object", "something shaped like a ball", "ball-shaped thing"),
    "something that rolls",
)
_TABLE_PHRASES = ("table", "surface", "background", "empty table", "the table top")
_OTHER_PHRASES = ("background", "floor", "wall", "nothing", "empty space")
_NAME_PHRASES = ("{}", "{}", "{}", "the {}", "any {} here")
_SIMILAR = 0.62

POSITIVE, NEGATIVE, IGNORED = 1, 0, -1


@dataclass(frozen=True, kw_only=True)
class Concept:
    """Something that holds of objects, with the phrases that say it.

    Attributes:
        kind: "name", "color", "shape", "category", "function" or "place".
        word: The name, or the word of `ObjectWords`.
        phrases: Phrases; the first one is the plainest.
    """

    kind: str
    word: str
    phrases: tuple[str, ...]


def concepts_of(words: ObjectWords) -> list[Concept]:
    """List what holds of an object; names come first."""
    return [
        *(name_concept(name) for name in names_of(words)),
        *(color_concept(color) for color in words.colors),
        *(Concept(kind="shape", word=shape, phrases=_ROUND_PHRASES) for shape in words.shapes),
        *(function_concept(function) for function in words.functions),
        *([category_concept(words.category)] if words.category else []),
    ]


def names_of(words: ObjectWords) -> list[str]:
    """List label and synonyms, without those that only name a colour."""
    names = [*([words.label] if words.label else []), *words.synonyms]
    return [n for n in dict.fromkeys(names) if not n.endswith(" object") and n not in CATEGORIES]


def name_concept(name: str) -> Concept:
    """Return the concept of a name."""
    return Concept(kind="name", word=name, phrases=tuple(p.format(name) for p in _NAME_PHRASES))


def color_concept(color: str) -> Concept:
    """Return the concept of a colour."""
    phrases = tuple(p.format(color) for p in _ADJECTIVE_PHRASES)
    return Concept(kind="color", word=color, phrases=phrases)


def category_concept(category: str) -> Concept:
    """Return the concept of a category."""
    return Concept(kind="category", word=category, phrases=_CATEGORY_PHRASES[category])


def function_concept(function: str) -> Concept:
    """Return the concept of a function."""
    return Concept(kind="function", word=function, phrases=_FUNCTION_PHRASES[function])


PLACES = (
    Concept(kind="place", word="table", phrases=_TABLE_PHRASES),
    Concept(kind="place", word="other", phrases=_OTHER_PHRASES),
)
"""Concepts of what is no object, in the order of `tools.encoder.features.TABLE` and `OTHER`."""


def collect_concepts(objects: Sequence[ObjectWords]) -> list[Concept]:
    """List the concepts of many objects, each once, places first."""
    found = {(c.kind, c.word): c for words in objects for c in concepts_of(words)}
    return [*PLACES, *(found[key] for key in sorted(found))]


def encode_phrases(encoder: EmbeddedEncoder, concepts: Sequence[Concept]) -> list[np.ndarray]:
    """Encode the phrases of concepts.

    Args:
        encoder: The encoder; only its text tower is used.
        concepts: The concepts.

    Returns:
        One (P, 384) float32 array of unit rows for each concept.
    """
    distinct = sorted({phrase for concept in concepts for phrase in concept.phrases})
    features = dict(zip(distinct, encoder.encode_texts(distinct), strict=True))
    return [np.stack([features[p] for p in concept.phrases]) for concept in concepts]


def truth(
    concepts: Sequence[Concept], phrases: Sequence[np.ndarray], objects: Sequence[ObjectWords]
) -> np.ndarray:
    """Tell which concepts hold for which objects.

    A name that is nearly a synonym by the text tower's own judgement is ignored rather than taken
    for wrong, unless the colours contradict each other.

    Args:
        concepts: N concepts.
        phrases: Their features, from `encode_phrases`.
        objects: M objects.

    Returns:
        (N, M) int8 of `POSITIVE`, `NEGATIVE` and `IGNORED`.
    """
    row = {(c.kind, c.word): i for i, c in enumerate(concepts)}
    first = np.stack([p[0] for p in phrases])
    is_name = np.array([c.kind == "name" for c in concepts])
    mentioned = np.array([[color in c.word.split() for color in COLORS] for c in concepts])
    _, heads = np.unique([c.word.split()[-1] for c in concepts], return_inverse=True)
    color_rows = [(i, COLORS.index(c.word)) for i, c in enumerate(concepts) if c.kind == "color"]
    labels = np.zeros((len(concepts), len(objects)), np.int8)
    for column, words in enumerate(objects):
        own = [row[c.kind, c.word] for c in concepts_of(words) if (c.kind, c.word) in row]
        names = [i for i in own if is_name[i]]
        near = _near_colors(words)
        contradicts = (mentioned & ~near).any(axis=1) & bool(words.colors)
        alike = (first @ first[names].T).max(axis=1, initial=-1.0) > _SIMILAR
        has_head = np.zeros(heads.max() + 1, bool)
        has_head[heads[names]] = True
        alike |= has_head[heads]
        label = np.where(is_name & alike & ~contradicts, IGNORED, NEGATIVE).astype(np.int8)
        for i, color in color_rows:
            label[i] = IGNORED if not words.colors or near[color] else NEGATIVE
        if words.category == "cup" and ("category", "container") in row:
            label[row["category", "container"]] = IGNORED
        label[own] = POSITIVE
        labels[:, column] = label
    return labels


def _near_colors(words: ObjectWords) -> np.ndarray:
    """Tell which of `COLORS` an object has or nearly has."""
    near = set(words.colors)
    for one, other in _NEAR_COLORS:
        near |= {other} if one in words.colors else set()
        near |= {one} if other in words.colors else set()
    return np.array([color in near for color in COLORS])
