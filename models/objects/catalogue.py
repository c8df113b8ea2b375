"""The object catalogue: names, words, and assets on demand.

Example:
    >>> from models.objects.catalogue import load_object, object_names
    >>> load_object("apple").words.category
    'fruit'
"""

import difflib
import functools

from models.errors import UnknownNameError
from models.objects.asset import ObjectAsset, assemble
from models.objects.entry import Entry
from models.objects.words import ObjectWords

SPLITS = ("seen", "unseen")


@functools.cache
def _entries() -> dict[str, tuple[str, Entry]]:
    """Index both splits by name."""
    from models.objects.entries import SEEN, UNSEEN

    return {
        entry.name: (split, entry)
        for split, entries in (("seen", SEEN), ("unseen", UNSEEN))
        for entry in entries
    }


def object_names(split: str | None = None) -> tuple[str, ...]:
    """List the objects of a split, or of both.

    Args:
        split: "seen", "unseen" or None.

    Returns:
        Names in catalogue order.

    Raises:
        UnknownNameError: If there is no such split.
    """
    if split is not None and split not in SPLITS:
        raise UnknownNameError(_message("split", split, SPLITS))
    return tuple(name for name, (owner, _) in _entries().items() if split in (None, owner))


def object_words(name: str) -> ObjectWords:
    """Return the words of an object without building it.

    Args:
        name: Name in the catalogue.

    Returns:
        The words.

    Raises:
        UnknownNameError: If there is no such object.
    """
    return _entry(name)[1].words


def load_object(name: str) -> ObjectAsset:
    """Return an object, from the disk cache where possible.

    Args:
        name: Name in the catalogue.

    Returns:
        The asset; equal names give equal bytes.

    Raises:
        UnknownNameError: If there is no such object.
    """
    from models.objects.cache import load_or_build

    _entry(name)
    return load_or_build(name, functools.partial(build_asset, name))


def build_asset(name: str) -> ObjectAsset:
    """Build an object from its parameters, past the cache.

    Args:
        name: Name in the catalogue.

    Returns:
        The asset.

    Raises:
        UnknownNameError: If there is no such object.
    """
    split, entry = _entry(name)
    return assemble(
        entry.shape(),
        name=name,
        family=entry.family,
        split=split,
        words=entry.words,
        matter=entry.matter,
    )


def _entry(name: str) -> tuple[str, Entry]:
    """Look up split and entry, or say which names exist."""
    try:
        return _entries()[name]
    except KeyError:
        raise UnknownNameError(_message("object", name, tuple(_entries()))) from None


def _message(kind: str, name: str, known: tuple[str, ...]) -> str:
    """Say what exists and what was probably meant."""
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    return f"Unknown {kind} {name!r}. {kind.capitalize()}s: {', '.join(known)}.{hint}"
