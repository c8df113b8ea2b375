"""Writes a catalogue folder: every object whole or not at all."""

import dataclasses
import json
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.errors import CatalogueFolderError, ImportRefusedError
from models.objects.folder_catalogue import FORMAT_VERSION, INDEX_NAME, read_index
from models.objects.mjcf_object import content_hash
from models.objects.words import ObjectWords

_OBJECT_FILE = "object.npz"


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file so that no reader, and no crash, ever sees half of it.

    Args:
        path: The file; its folder is made.
        data: The content.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Where an imported object came from.

    Attributes:
        source: The file that was imported.
        key: Hash of its content, of every file it names and of the settings.
        graspnet_id: Its number in GraspNet-1Billion, three digits, or None.
    """

    source: str
    key: str
    graspnet_id: str | None = None


class CatalogueStore:
    """A catalogue folder that is being written.

    Args:
        folder: The folder; made with the first object if there is none.

    Raises:
        CatalogueFolderError: If it holds something else, or is damaged.
    """

    def __init__(self, folder: Path) -> None:
        """Read the index, if there is one."""
        self._folder = folder
        if folder.exists() and not folder.is_dir():
            raise CatalogueFolderError(f"{folder} is a file; name a folder for the catalogue.")
        used = folder.is_dir() and any(not p.name.startswith(".") for p in folder.iterdir())
        # A first run that was interrupted leaves objects without an index; they are not there.
        fresh = not used or {p.name for p in folder.iterdir()} <= {"objects"}
        self._entries: dict[str, dict[str, Any]] = {} if fresh else read_index(folder)

    def has(self, name: str, origin: Origin) -> bool:
        """Tell whether an object was imported from the same content with the same settings.

        Args:
            name: Name in the catalogue.
            origin: Where it comes from.

        Returns:
            True if there is nothing to do but to keep its words.
        """
        entry = self._entries.get(name)
        if entry is None or entry["key"] != origin.key:
            return False
        path = self._folder / entry["file"]
        return path.is_file() and content_hash(path.read_bytes()) == entry["hash"]

    def check_name(self, name: str, origin: Origin) -> None:
        """Refuse to put an object in the place of another one.

        Args:
            name: Name in the catalogue.
            origin: Where the new object comes from.

        Raises:
            ImportRefusedError: If the name belongs to an object from another file.
        """
        entry = self._entries.get(name)
        if entry is not None and origin.source != entry["source"] and entry["key"] != origin.key:
            raise ImportRefusedError(
                f"{origin.source} would replace {name!r}, imported from {entry['source']}; give "
                "it another name in the words file."
            )

    def keep(self, name: str, words: ObjectWords, origin: Origin) -> None:
        """Bring the words and the origin of an object up to date.

        Args:
            name: Name of an object that is here.
            words: Its words.
            origin: Where it came from.
        """
        fields = {"words": _plain(words), **dataclasses.asdict(origin)}
        if fields.items() <= self._entries[name].items():
            return
        self._put({**self._entries, name: {**self._entries[name], **fields}})

    def add(self, name: str, words: ObjectWords, origin: Origin, *, kind: str, data: bytes) -> None:
        """Write an object, then the index; the object is there when the index says so.

        Args:
            name: Name in the catalogue.
            words: Its words.
            origin: Where it came from.
            kind: "mesh" or "mjcf".
            data: The encoded object.
        """
        digest = content_hash(data)
        file = Path("objects") / f"{name}-{digest[:12]}" / _OBJECT_FILE
        write_atomically(self._folder / file, data)
        entry = {"words": _plain(words), "kind": kind, "file": file.as_posix(), "hash": digest}
        old = self._entries.get(name)
        self._put({**self._entries, name: {**entry, **dataclasses.asdict(origin)}})
        if old is not None and old["file"] != file.as_posix():
            shutil.rmtree((self._folder / old["file"]).parent, ignore_errors=True)

    def _put(self, entries: dict[str, dict[str, Any]]) -> None:
        text = json.dumps({"format": FORMAT_VERSION, "objects": entries}, indent=1)
        write_atomically(self._folder / INDEX_NAME, (text + "\n").encode())
        self._entries = entries


def _plain(words: ObjectWords) -> dict[str, Any]:
    """Return words as JSON has them, so that they compare equal to what was read."""
    return json.loads(json.dumps(dataclasses.asdict(words)))
