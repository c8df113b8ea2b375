"""`Draft`, a drawn variant that is not built yet, and the small draws that recipes are made of."""

import dataclasses
import hashlib
import inspect
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np

from models.objects.asset import Matter, Shape
from models.objects.words import ObjectWords

_T = TypeVar("_T")
_MAX_SYNONYMS = 8
# Seeds of the catalogue are smaller, so that no variant shares a texture with an entry.
LEAST_SEED = 10_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Draft:
    """A variant of a family, not built yet.

    Attributes:
        shape: Builds the geometry: a family with its parameters bound.
        words: How people ask for it.
        matter: Mass or density.
    """

    shape: partial[Shape]
    words: ObjectWords
    matter: Matter

    @property
    def family(self) -> str:
        """Name of the family."""
        return self.shape.func.__name__

    @property
    def name(self) -> str:
        """The word "sample" and eight digits that depend on family and parameters alone."""
        text = json.dumps([self.family, list(leaves(parameters(self.shape)))])
        return f"sample_{hashlib.sha256(text.encode()).hexdigest()[:8]}"


Recipe = Callable[[np.random.Generator], Draft]


def parameters(shape: partial[Shape]) -> dict[str, Any]:
    """Return all parameters of a bound family by name, defaults included."""
    bound = inspect.signature(shape.func).bind(*shape.args, **shape.keywords)
    bound.apply_defaults()
    return dict(bound.arguments)


def is_color(value: object) -> bool:
    """Tell an RGB triple from other parameters: only colours are three whole numbers."""
    return isinstance(value, tuple) and len(value) == 3 and all(type(v) is int for v in value)


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Walk nested parameters.

    Args:
        value: A parameter, or a mapping, a sequence or a dataclass of parameters.
        path: Name of the value itself.

    Yields:
        Dotted path and value of each number, string or colour, in a fixed order.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        nested = ((str(key), item) for key, item in value.items())
    elif isinstance(value, (tuple, list)) and not is_color(value):
        nested = ((str(index), item) for index, item in enumerate(value))
    else:
        yield path, value
        return
    for key, item in nested:
        yield from leaves(item, f"{path}.{key}" if path else key)


def span(rng: np.random.Generator, low: float, high: float, digits: int = 4) -> float:
    """Draw a number between two limits, rounded: lengths in metres to a tenth of a millimetre."""
    return round(float(rng.uniform(low, high)), digits)


def pick(rng: np.random.Generator, options: Sequence[_T]) -> _T:
    """Draw one of several options."""
    return options[int(rng.integers(len(options)))]


def draw_seed(rng: np.random.Generator) -> int:
    """Draw a texture seed that no entry of the catalogue has."""
    return int(rng.integers(LEAST_SEED, 2**31))


def describe(
    noun: str,
    *others: str,
    colors: Sequence[str],
    colored: bool = False,
    category: str | None = None,
    shapes: tuple[str, ...] = (),
    functions: tuple[str, ...] = (),
) -> ObjectWords:
    """Word a variant.

    Args:
        noun: The noun phrase that says best what it is, without colour.
        others: Other noun phrases for it, most usual first.
        colors: Names of its colours, most dominant first; repetitions are dropped.
        colored: Put the first colour into the label.
        category: See `ObjectWords`.
        shapes: See `ObjectWords`.
        functions: See `ObjectWords`.

    Returns:
        Words with three to eight synonyms.
    """
    names = tuple(dict.fromkeys(colors))
    tint, generic = names[0], "object" if category is None else category
    label = _tinted(tint, noun) if colored else noun
    phrases = [noun, *others, _tinted(tint, noun)]
    if len(names) > 1:
        phrases.append(_tinted(f"{tint} and {names[1]}", noun))
    phrases += [*(_tinted(tint, other) for other in others[:2]), f"{tint} {generic}"]
    synonyms = [phrase for phrase in dict.fromkeys(phrases) if phrase != label]
    return ObjectWords(
        label=label,
        synonyms=tuple(synonyms[:_MAX_SYNONYMS]),
        category=category,
        colors=names[:3],
        shapes=shapes,
        functions=functions,
    )


def _tinted(tint: str, phrase: str) -> str:
    """Put a colour before a phrase, unless the phrase has the word already: "orange juice"."""
    return phrase if tint in phrase.split() else f"{tint} {phrase}"
