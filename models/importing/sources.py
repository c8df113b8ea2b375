"""Finds objects in a folder, as YCB, GraspNet-1Billion, scans and MJCF collections lay them out."""

import re
from dataclasses import dataclass
from pathlib import Path

from models.errors import ImportRefusedError
from models.importing.mesh_file import MESH_SUFFIXES

# Where the well-known collections keep the mesh of an object, the best first.
_KNOWN_MESHES = (
    "google_16k/textured.obj",  # YCB; the finer ones would be decimated here
    "google_64k/textured.obj",
    "google_512k/textured.obj",
    "tsdf/textured.obj",
    "poisson/textured.obj",
    "meshes/model.obj",  # Google Scanned Objects
    "textured.obj",  # GraspNet-1Billion
    "textured_simple.obj",
    "textured_simple_reoriented.obj",
    "model.obj",
    "model.glb",
)
# Files beside an object's mesh that are no objects.
_AUXILIARY = re.compile(r"collision|vhacd|coacd|nontextured|simplified|_col$|convex")
_PLAIN_STEMS = {"textured", "model", "object", "mesh", "textured_simple", "scene", "visual"}
_MAX_DEPTH = 3


@dataclass(frozen=True, kw_only=True)
class Source:
    """A file that describes one object.

    Attributes:
        path: The mesh or MJCF file.
        root: The object's folder; everything it names must be inside.
        keys: Names under which a words file may have it, the first is the usual one.
        kind: "mesh" or "mjcf".
    """

    path: Path
    root: Path
    keys: tuple[str, ...]
    kind: str

    @property
    def graspnet_id(self) -> str | None:
        """Number in GraspNet-1Billion if its folder is called so, as in `models/005`."""
        return self.keys[0] if re.fullmatch(r"\d{3}", self.keys[0]) else None


def find_sources(src: Path, root: Path | None = None) -> tuple[Source, ...]:
    """Find the objects in a file, in an object's folder, or in a folder of such folders.

    Args:
        src: File or folder.
        root: Folder that may be used by all objects; by default each has its own.

    Returns:
        The objects, sorted by path.

    Raises:
        ImportRefusedError: If there are none, or a folder leaves open which file is the object.
    """
    if not src.exists():
        raise ImportRefusedError(f"{src} does not exist; name a mesh, an MJCF file or a folder.")
    if src.is_file():
        return (_from_file(src, root),)
    sources = _search(src, root, depth=0)
    if not sources:
        raise ImportRefusedError(
            f"{src} has no objects; expected {', '.join(MESH_SUFFIXES)} or MJCF files, in the "
            "folder or one folder an object."
        )
    return tuple(sources)


def _from_file(path: Path, root: Path | None) -> Source:
    """Describe a file that was named."""
    if path.suffix.lower() not in MESH_SUFFIXES and path.suffix.lower() != ".xml":
        raise ImportRefusedError(
            f"{path} is no object; expected one of {', '.join((*MESH_SUFFIXES, '.xml'))}."
        )
    return _source(path, path.parent, root)


def _source(path: Path, folder: Path, root: Path | None, *, own: bool = False) -> Source:
    """Describe an object; `own` says that its folder is named after it."""
    around = folder.resolve().name
    named_by_folder = own or path.stem.lower() in _PLAIN_STEMS
    keys = (around, path.stem) if named_by_folder else (path.stem, around)
    kind = "mjcf" if path.suffix.lower() == ".xml" else "mesh"
    return Source(path=path, root=root or folder, keys=keys, kind=kind)


def _search(folder: Path, root: Path | None, depth: int) -> list[Source]:
    """Look for an object in a folder, else for several, else in the folders below."""
    for name in _KNOWN_MESHES:
        if (folder / name).is_file():
            return [_source(folder / name, folder, root, own=True)]
    files = sorted(path for path in folder.iterdir() if path.is_file())
    documents = [path for path in files if path.suffix.lower() == ".xml" and _is_mjcf(path)]
    if documents:
        own = len(documents) == 1 and depth > 0
        return [_source(path, folder, root, own=own) for path in documents]
    meshes = [path for path in files if path.suffix.lower() in MESH_SUFFIXES]
    meshes = [path for path in meshes if not _AUXILIARY.search(path.stem.lower())]
    if len(meshes) > 1 and depth > 0:
        named = [path for path in meshes if path.stem == folder.name]
        if not named:
            raise ImportRefusedError(
                f"{folder} has several meshes ({', '.join(p.name for p in meshes[:4])}); import "
                "the right file alone."
            )
        meshes = named[:1]
    if meshes:
        return [_source(path, folder, root, own=depth > 0) for path in meshes]
    if depth == _MAX_DEPTH:
        return []
    below = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    return [source for path in below for source in _search(path, root, depth + 1)]


def _is_mjcf(path: Path) -> bool:
    # Collections of meshes do not need what reads MJCF.
    from models.importing.mjcf_folder import is_mjcf

    return is_mjcf(path)
