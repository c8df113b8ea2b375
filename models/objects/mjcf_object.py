"""`MjcfObject`, an object that came as MJCF and keeps its own geoms."""

import dataclasses
import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from models.errors import AssetError
from models.objects.words import ObjectWords

_ARRAYS = ("vertices", "faces", "center_of_mass", "inertia")


@dataclass(frozen=True, kw_only=True, eq=False)
class MjcfObject:
    """An object described by an MJCF document of its own.

    The document has one body `object` without joints; its frame is that of `ObjectAsset`: origin
    on the lowest point of the visual surface, under the centre of its bounding box, z up.

    Attributes:
        name: Name in the catalogue.
        words: How people ask for it.
        xml: The document: assets and the body, nothing else.
        assets: Contents of the files that the document names.
        vertices: (V, 3) float64 of the visual surface, metres.
        faces: (F, 3) int32.
        mass_kg: Mass.
        center_of_mass: (3,) float64, metres.
        inertia: (3, 3) float64 about the centre of mass along the frame's axes, kg m^2.
        matter_source: Where the mass comes from.
    """

    name: str
    words: ObjectWords
    xml: str
    assets: Mapping[str, bytes]
    vertices: np.ndarray
    faces: np.ndarray
    mass_kg: float
    center_of_mass: np.ndarray
    inertia: np.ndarray
    matter_source: str

    def __post_init__(self) -> None:
        """Check values once, and make everything read-only."""
        object.__setattr__(self, "assets", MappingProxyType(dict(self.assets)))
        for field in _ARRAYS:
            array = getattr(self, field)
            if not np.all(np.isfinite(array)):
                raise AssetError(f"{field} of object {self.name!r} is not finite; import it again.")
            array.setflags(write=False)
        if not self.mass_kg > 0:
            raise AssetError(f"Mass of object {self.name!r} is {self.mass_kg}; it must be > 0.")

    @property
    def size_m(self) -> np.ndarray:
        """Extents (3,) of the visual surface along x, y and z in the rest pose, metres."""
        return np.ptp(self.vertices, axis=0)


def encode_mjcf(item: MjcfObject) -> bytes:
    """Serialise an object; the same object gives the same bytes.

    Args:
        item: The object.

    Returns:
        An npz archive.
    """
    names = sorted(item.assets)
    record = {
        "name": item.name,
        "words": dataclasses.asdict(item.words),
        "xml": item.xml,
        "assets": names,
        "mass_kg": item.mass_kg,
        "matter_source": item.matter_source,
    }
    arrays = {name: getattr(item, name) for name in _ARRAYS}
    for index, name in enumerate(names):
        arrays[f"asset_{index}"] = np.frombuffer(item.assets[name], np.uint8)
    text = np.frombuffer(json.dumps(record, sort_keys=True).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, record=text, **arrays)
    return buffer.getvalue()


def decode_mjcf(data: bytes) -> MjcfObject:
    """Restore an object from `encode_mjcf`'s bytes.

    Args:
        data: The archive.

    Returns:
        The object.
    """
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        record = json.loads(archive["record"].tobytes())
        names = record.pop("assets")
        assets = {name: archive[f"asset_{i}"].tobytes() for i, name in enumerate(names)}
        arrays = {name: archive[name] for name in _ARRAYS}
    lists: dict[str, Any] = record.pop("words")
    plain: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in lists.items()}
    return MjcfObject(words=ObjectWords(**plain), assets=assets, **record, **arrays)


def content_hash(data: bytes) -> str:
    """Return the hash by which a catalogue folder recognises an object's file."""
    return hashlib.sha256(data).hexdigest()
