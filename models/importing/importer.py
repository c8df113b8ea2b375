"""Takes a set of objects into a catalogue folder, one after the other."""

import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from tqdm import tqdm

from models.errors import AssetError, WordsFileError
from models.importing.labels import Label, label_from_stem
from models.importing.mesh_object import MeshSettings, mesh_key, read_mesh_object
from models.importing.sources import Source
from models.importing.store import CatalogueStore, Origin
from models.objects.cache import encode

Unlabelled = Literal["refuse", "skip", "stem"]
_LISTED = 12


@dataclass(frozen=True, kw_only=True)
class Tally:
    """What became of the objects.

    Attributes:
        imported: Names of those that were taken in.
        kept: Names of those that were there already.
        refused: One message for each that was not.
        notes: What the user should know about others.
    """

    imported: tuple[str, ...]
    kept: tuple[str, ...]
    refused: tuple[str, ...]
    notes: tuple[str, ...]


def match_labels(
    sources: Sequence[Source], labels: dict[str, Label], unlabelled: Unlabelled
) -> tuple[tuple[Source, Label], ...]:
    """Give every object its words.

    Args:
        sources: The objects.
        labels: The words file, by key.
        unlabelled: What to do with an object that it lacks: refuse everything, skip the object,
            or take its file's or folder's name for its label.

    Returns:
        Those objects that are to be imported, with their labels.

    Raises:
        WordsFileError: If objects have no words, or two have one name.
    """
    found = [(s, next((labels[k] for k in s.keys if k in labels), None)) for s in sources]
    missing = [source.keys[0] for source, label in found if label is None]
    if missing and unlabelled == "refuse":
        more = f" and {len(missing) - _LISTED} more" if len(missing) > _LISTED else ""
        raise WordsFileError(
            f"No words for: {', '.join(missing[:_LISTED])}{more}; add them to the words file "
            "(--labels), or choose --unlabelled stem (their names are their labels) or skip."
        )
    if unlabelled == "stem":
        found = [(source, label or label_from_stem(source.keys[0])) for source, label in found]
    matched = tuple((source, label) for source, label in found if label is not None)
    _refuse_same_names(matched)
    return matched


def _refuse_same_names(matched: Sequence[tuple[Source, Label]]) -> None:
    owners: dict[str, Source] = {}
    for source, label in matched:
        other = owners.setdefault(label.name, source)
        if other is not source:
            raise WordsFileError(
                f"{other.path} and {source.path} would both be {label.name!r}; give each its own "
                "entry with a name in the words file."
            )


def import_objects(
    matched: Sequence[tuple[Source, Label]], store: CatalogueStore, settings: MeshSettings
) -> Tally:
    """Import objects; one that is refused does not keep the others out.

    Args:
        matched: The objects and their labels.
        store: Where to.
        settings: How meshes are taken in.

    Returns:
        What became of them.
    """
    imported: list[str] = []
    kept: list[str] = []
    refused: list[str] = []
    notes: list[str] = []
    with tqdm(matched, unit="object", file=sys.stderr, disable=None, dynamic_ncols=True) as bar:
        for source, label in bar:
            bar.set_description(label.name)
            try:
                is_new = _import_one(source, label, store, settings, notes.append, bar.refresh)
                (imported if is_new else kept).append(label.name)
            except AssetError as error:
                refused.append(str(error))
    return Tally(
        imported=tuple(imported), kept=tuple(kept), refused=tuple(refused), notes=tuple(notes)
    )


def _import_one(
    source: Source,
    label: Label,
    store: CatalogueStore,
    settings: MeshSettings,
    note: Callable[[str], None],
    on_wait: Callable[[], object],
) -> bool:
    """Import an object unless it is there; tell whether it was imported."""
    if source.kind == "mjcf":
        return _import_mjcf(source, label, store)
    key = mesh_key(source.path, source.root, label, settings)
    origin = _origin(source, key)
    if store.has(label.name, origin):
        store.keep(label.name, label.words, origin)
        return False
    store.check_name(label.name, origin)
    mesh = read_mesh_object(source.path, source.root, label, settings, on_wait)
    store.add(label.name, label.words, origin, kind="mesh", data=encode(mesh.asset))
    for line in mesh.notes:
        note(line)
    return True


def _import_mjcf(source: Source, label: Label, store: CatalogueStore) -> bool:
    """Import an MJCF object; it is read anew each time, which costs little."""
    from models.importing.mjcf_folder import read_mjcf_object
    from models.objects.mjcf_object import encode_mjcf

    item = read_mjcf_object(
        source.path, name=label.name, words=label.words, root=source.root, mass_kg=label.mass_kg
    )
    data = encode_mjcf(item)
    # The words live in the index, so that new words alone are no new object.
    figures = json.dumps([item.name, item.mass_kg, sorted(item.assets)]).encode()
    digest = hashlib.sha256(figures + item.xml.encode())
    for name in sorted(item.assets):
        digest.update(item.assets[name])
    origin = _origin(source, digest.hexdigest())
    if store.has(label.name, origin):
        store.keep(label.name, label.words, origin)
        return False
    store.check_name(label.name, origin)
    store.add(label.name, label.words, origin, kind="mjcf", data=data)
    return True


def _origin(source: Source, key: str) -> Origin:
    return Origin(source=source.path.resolve().as_posix(), key=key, graspnet_id=source.graspnet_id)
