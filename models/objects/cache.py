"""A disk cache of built objects, keyed by the content of everything that shapes them."""

import dataclasses
import functools
import hashlib
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PIL
import scipy
import trimesh

from models.errors import AssetError
from models.objects.asset import ObjectAsset
from models.objects.collision import CollisionPart
from models.objects.words import ObjectWords

_ARRAYS = ("vertices", "faces", "uv", "texture", "center_of_mass", "inertia")


def cache_dir() -> Path:
    """Return the directory of the cache.

    `SR_MJ_CACHE` names it; otherwise it is `sr_mj` under `XDG_CACHE_HOME` or `~/.cache`.
    """
    if override := os.environ.get("SR_MJ_CACHE"):
        return Path(override).expanduser()
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(home) / "sr_mj"


@functools.cache
def _generator_digest() -> str:
    """Hash the sources of this package and the versions of the libraries that draw and measure."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    versions = [module.__version__ for module in (np, PIL, scipy, trimesh)]
    digest.update(json.dumps(versions).encode())
    return digest.hexdigest()


def entry_path(name: str) -> Path:
    """Return the file that holds, or would hold, the built object `name`."""
    key = hashlib.sha256(f"{_generator_digest()}/{name}".encode()).hexdigest()[:16]
    return cache_dir() / "objects" / f"{name}-{key}.npz"


def encode(asset: ObjectAsset) -> bytes:
    """Serialise an asset; the same asset gives the same bytes."""
    parts = [
        {**dataclasses.asdict(part), "vertices": part.vertices.tolist()} for part in asset.collision
    ]
    plain = {
        field.name: getattr(asset, field.name)
        for field in dataclasses.fields(asset)
        if field.name not in (*_ARRAYS, "words", "collision")
    }
    record = {"plain": plain, "words": dataclasses.asdict(asset.words), "collision": parts}
    arrays = {name: getattr(asset, name) for name in _ARRAYS}
    text = np.frombuffer(json.dumps(record, sort_keys=True).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, record=text, **arrays)
    return buffer.getvalue()


def decode(data: bytes) -> ObjectAsset:
    """Restore an asset from `encode`'s bytes."""
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        record = json.loads(archive["record"].tobytes())
        arrays = {name: archive[name] for name in _ARRAYS}
    collision = []
    for part in record["collision"]:
        vertices = np.array(part.pop("vertices"), float).reshape(-1, 3)
        collision.append(CollisionPart(vertices=vertices, **_tuples(part)))
    words = ObjectWords(**_tuples(record["words"]))
    return ObjectAsset(words=words, collision=tuple(collision), **record["plain"], **arrays)


def _tuples(fields: dict[str, Any]) -> dict[str, Any]:
    """Turn the lists that JSON knows back into tuples."""
    return {key: tuple(v) if isinstance(v, list) else v for key, v in fields.items()}


def _write(path: Path, data: bytes) -> None:
    """Write a file so that no reader, and no crash, ever sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def load_or_build(name: str, build: Callable[[], ObjectAsset]) -> ObjectAsset:
    """Return the cached object, or build and cache it.

    An entry that cannot be read is rebuilt; a directory that cannot be written is no error, the
    object is then built each time.

    Args:
        name: Name in the catalogue.
        build: Builds it.

    Returns:
        The object.
    """
    path = entry_path(name)
    try:
        return decode(path.read_bytes())
    except FileNotFoundError:
        pass
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, AssetError):
        # A damaged entry is worth no more than a missing one.
        pass
    asset = build()
    try:
        _write(path, encode(asset))
    except OSError:
        # A read-only home must not keep anyone from simulating.
        pass
    return asset
