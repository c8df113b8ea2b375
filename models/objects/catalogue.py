"""The object catalogue: names, words, and assets on demand.

Example:
    >>> from models.objects.catalogue import load_object, object_names
    >>> load_object("apple").words.category
    'fruit'
"""

import difflib
import functools
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Union

from models.errors import UnknownNameError
from models.objects.asset import ObjectAsset, assemble
from models.objects.entry import Entry
from models.objects.words import ObjectWords

if TYPE_CHECKING:
    from models.objects.mjcf_object import MjcfObject

    CatalogueObject = Union[ObjectAsset, MjcfObject]  # noqa: UP007  # one is only imported here

SPLITS = ("seen", "unseen")


class Catalogue(Protocol):
    """Where a scene's objects come from: the built-in catalogue, or a folder of imported ones.

    Attributes:
        source: What to call it in messages.
    """

    source: str

    def names(self, split: str | None = None) -> tuple[str, ...]:
        """List the objects of a split, or all; a folder has no splits and always lists all."""
        ...

    def words(self, name: str) -> ObjectWords:
        """Return the words of an object; `UnknownNameError` if there is no such object."""
        ...

    def load(self, name: str) -> "CatalogueObject":
        """Return an object; `UnknownNameError` if there is no such object."""
        ...

    def by_graspnet_id(self, graspnet_id: str) -> str | None:
        """Return the name of the object that stands for an id of GraspNet-1Billion, if any."""
        ...


class BuiltInCatalogue:
    """The objects made by code in this package."""

    source = "the built-in catalogue"

    def names(self, split: str | None = None) -> tuple[str, ...]:
        """List names; see `object_names`."""
        return object_names(split)

    def words(self, name: str) -> ObjectWords:
        """Return words; see `object_words`."""
        return object_words(name)

    def load(self, name: str) -> ObjectAsset:
        """Return an object; see `load_object`."""
        return load_object(name)

    def by_graspnet_id(self, graspnet_id: str) -> str | None:
        """Return the name of our stand-in; None for an id that GraspNet-1Billion does not have."""
        from models.objects.graspnet import stand_in

        try:
            return stand_in(graspnet_id).object_name
        except UnknownNameError:
            return None


def open_catalogue(folder: Path | None = None) -> Catalogue:
    """Open the built-in catalogue, or a folder made by `python -m models.import_objects`.

    Args:
        folder: The folder; None for the built-in catalogue.

    Returns:
        The catalogue.

    Raises:
        AssetError: If the folder is not a catalogue.
    """
    if folder is None:
        return BuiltInCatalogue()
    from models.objects.folder_catalogue import FolderCatalogue

    return FolderCatalogue(folder)


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
