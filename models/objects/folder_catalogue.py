"""A catalogue of imported objects: a folder with an index and a file an object.

    catalogue.json          format version and, for each object, words, file, hash and origin
    objects/NAME-HASH/      object.npz: geometry, texture, physics

The index is the only way in: what it does not name is not there.
"""

import dataclasses
import difflib
import json
import zipfile
from pathlib import Path
from typing import Any

from models.errors import AssetError, CatalogueFolderError, UnknownNameError
from models.objects.asset import ObjectAsset
from models.objects.cache import decode
from models.objects.mjcf_object import MjcfObject, content_hash, decode_mjcf
from models.objects.words import ObjectWords

INDEX_NAME = "catalogue.json"
FORMAT_VERSION = 1
_FIELDS = {"words", "kind", "file", "hash", "key", "source", "graspnet_id"}


def read_index(folder: Path) -> dict[str, dict[str, Any]]:
    """Read the index of a catalogue folder.

    Args:
        folder: The folder.

    Returns:
        Entry by object name, in the order of import.

    Raises:
        CatalogueFolderError: If there is none, or it is not one of ours.
    """
    path = folder / INDEX_NAME
    try:
        index = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, NotADirectoryError):
        raise CatalogueFolderError(
            f"{folder} is not a catalogue: it has no {INDEX_NAME}. Make one with "
            "python -m models.import_objects SRC DEST --labels words.yaml"
        ) from None
    except ValueError as error:
        raise CatalogueFolderError(
            f"{path} is damaged: {error}; delete the folder and import again."
        ) from None
    version = index.get("format") if isinstance(index, dict) else None
    if version != FORMAT_VERSION:
        raise CatalogueFolderError(
            f"{path} has format {version!r}, expected {FORMAT_VERSION}; import the objects again."
        )
    objects = index.get("objects")
    if not isinstance(objects, dict) or not all(_is_entry(entry) for entry in objects.values()):
        raise CatalogueFolderError(
            f"{path} is damaged: its objects lack fields; delete the folder and import again."
        )
    return objects


def _is_entry(entry: Any) -> bool:
    """Tell whether an entry has every field, and a file that stays inside the folder."""
    if not isinstance(entry, dict) or not _FIELDS <= set(entry):
        return False
    file = Path(str(entry["file"]))
    return not file.is_absolute() and ".." not in file.parts and isinstance(entry["words"], dict)


def parse_words(fields: dict[str, Any]) -> ObjectWords:
    """Make words from their JSON form.

    Args:
        fields: Fields of `ObjectWords`, lists in place of tuples.

    Returns:
        The words.
    """
    plain: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
    return ObjectWords(**plain)


class FolderCatalogue:
    """The objects of a folder made by `python -m models.import_objects`.

    Args:
        folder: The folder.

    Raises:
        CatalogueFolderError: If it is not a catalogue.
    """

    def __init__(self, folder: Path) -> None:
        """Read the index; objects are read when they are asked for."""
        self._folder = Path(folder)
        self._entries = read_index(self._folder)
        self.source = f"the catalogue in {self._folder}"

    def names(self, split: str | None = None) -> tuple[str, ...]:
        """List the objects.

        Args:
            split: Ignored: a folder has no splits.

        Returns:
            Names in alphabetical order.
        """
        return tuple(sorted(self._entries))

    def words(self, name: str) -> ObjectWords:
        """Return the words of an object.

        Args:
            name: Name in the catalogue.

        Returns:
            The words.

        Raises:
            UnknownNameError: If there is no such object.
            CatalogueFolderError: If the index has words that are none.
        """
        try:
            return parse_words(self._entry(name)["words"])
        except TypeError as error:
            raise CatalogueFolderError(
                f"The words of {name!r} in {self._folder / INDEX_NAME} are damaged ({error}); "
                "import the object again."
            ) from None

    def fingerprint(self, name: str) -> str:
        """Return the hash of an object's content: geometry, texture, physics.

        Args:
            name: Name in the catalogue.

        Returns:
            A SHA-256 in hexadecimal.

        Raises:
            UnknownNameError: If there is no such object.
        """
        return str(self._entry(name)["hash"])

    def by_graspnet_id(self, graspnet_id: str | int) -> str | None:
        """Return the name of the object imported from a GraspNet-1Billion model.

        Args:
            graspnet_id: Its number, as in "005" or 5.

        Returns:
            The name, or None if there is no such object here.
        """
        wanted = str(graspnet_id).zfill(3)
        for name, entry in self._entries.items():
            if entry["graspnet_id"] == wanted:
                return name
        return None

    def load(self, name: str) -> ObjectAsset | MjcfObject:
        """Read an object.

        Args:
            name: Name in the catalogue.

        Returns:
            The object.

        Raises:
            UnknownNameError: If there is no such object.
            CatalogueFolderError: If its file is missing or damaged.
        """
        entry = self._entry(name)
        path = self._folder / entry["file"]
        try:
            data = path.read_bytes()
            if content_hash(data) != entry["hash"]:
                raise ValueError("its hash differs from the index")
            item = (decode_mjcf if entry["kind"] == "mjcf" else decode)(data)
        except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, AssetError) as error:
            raise CatalogueFolderError(
                f"Object {name!r} in {self._folder} is damaged ({error}); import it again."
            ) from None
        return dataclasses.replace(item, words=self.words(name))

    def _entry(self, name: str) -> dict[str, Any]:
        if name in self._entries:
            return self._entries[name]
        close = difflib.get_close_matches(name, self._entries, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise UnknownNameError(
            f"Unknown object {name!r}. Objects in {self._folder}: {', '.join(self.names())}.{hint}"
        )
