"""What makes a variant new: nothing that training sees may equal an object kept for testing.

The rule, for every entry of the catalogue's unseen split:

1. Geometry. A variant of the entry's family is refused when all geometry parameters lie within
   `TOLERANCE` of the entry's, relative to the entry's value. Geometry parameters are all numbers
   except colours, seeds and the numbers in `PAINT_KEYS`; colours, patterns and kinds of cap do not
   make a variant new.
2. Print. A variant is refused when any word printed on it (any text among its parameters) occurs
   in a title of any entry: texts of the entry that are wholly upper case, such as "BLUE MOON",
   split into words and also run together, so that "REPEL LENT" bars "REPELLENT".

Words that people say stay free ("shampoo bottle", "yellow bowl"): a person names a thing of a known
kind alike, whichever instance it is. What a family prints on its own account, such as the TV on
a remote control, is no parameter and stays too.
"""

import functools
import re
from collections.abc import Iterator
from functools import partial
from typing import Any

from models.objects.asset import Shape
from models.objects.variants.draft import leaves, parameters

TOLERANCE = 0.04
PAINT_KEYS = ("span", "blush_amount", "fuzz")
# Parameters that are the name of a choice, not text to print.
_CHOICE_KEYS = ("cap", "emblem", "picture", "pattern", "crest", "extra", "kind")
# Below these, differences count as absolute: metres, and plain numbers.
_FLOOR_M = 0.001
_FLOOR = 0.02
_WORD = re.compile(r"[^\W_]+")


def geometry(shape: partial[Shape]) -> dict[str, float]:
    """Return the geometry parameters of a bound family by dotted name."""
    return {
        path: float(value)
        for path, value in leaves(parameters(shape))
        if isinstance(value, (int, float))
        and not isinstance(value, bool)
        and not {"seed", *PAINT_KEYS} & set(path.split("."))
    }


def printed_words(shape: partial[Shape]) -> frozenset[str]:
    """Return the words printed on a variant, upper case."""
    return frozenset(word.upper() for text in _texts(shape) for word in _WORD.findall(text))


def _texts(shape: partial[Shape]) -> Iterator[str]:
    """Yield the texts among the parameters."""
    for path, value in leaves(parameters(shape)):
        if isinstance(value, str) and path.split(".")[-1] not in _CHOICE_KEYS:
            yield value


@functools.cache
def reserved_words() -> frozenset[str]:
    """Return the words that no variant may print: those of the unseen entries' titles."""
    from models.objects.entries import UNSEEN

    titles = [t for entry in UNSEEN for t in _texts(entry.shape) if t and t == t.upper()]
    parts = [_WORD.findall(title) for title in titles]
    return frozenset(word for words in parts for word in (*words, "".join(words)))


def may_print(text: str) -> bool:
    """Tell whether a text has none of the reserved words."""
    return reserved_words().isdisjoint(word.upper() for word in _WORD.findall(text))


def is_near(shape: partial[Shape], other: partial[Shape]) -> bool:
    """Tell whether two variants of one family agree in all geometry parameters.

    Args:
        shape: The variant.
        other: The entry that it is compared with; its values are the scale of the tolerance.

    Returns:
        Whether all differences lie within `TOLERANCE`; False for different families.
    """
    return shape.func is other.func and _agrees(geometry(shape), geometry(other))


def _agrees(have: dict[str, float], want: dict[str, float]) -> bool:
    """Tell whether geometry parameters lie within the tolerance of an entry's."""
    if have.keys() != want.keys():
        return False
    return all(
        abs(have[key] - value) <= TOLERANCE * max(abs(value), _floor(key))
        for key, value in want.items()
    )


def _floor(key: str) -> float:
    """Return the value below which a parameter's tolerance stops shrinking."""
    return _FLOOR_M if "_m" in key else _FLOOR


@functools.cache
def _unseen_geometry() -> dict[Any, list[dict[str, float]]]:
    """Return the geometry parameters of the unseen entries by family function."""
    from models.objects.entries import UNSEEN

    found: dict[Any, list[dict[str, float]]] = {}
    for entry in UNSEEN:
        found.setdefault(entry.shape.func, []).append(geometry(entry.shape))
    return found


def is_novel(shape: partial[Shape]) -> bool:
    """Tell whether a variant keeps the rule at the head of this module.

    Args:
        shape: A family with its parameters bound.

    Returns:
        Whether it may be used for training.
    """
    if not printed_words(shape).isdisjoint(reserved_words()):
        return False
    own = geometry(shape)
    return not any(_agrees(own, other) for other in _unseen_geometry().get(shape.func, []))
