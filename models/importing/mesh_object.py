"""Turns a textured mesh of somebody else's into an `ObjectAsset`."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from models.errors import AssetError, ImportRefusedError
from models.importing.decimate import make_skin, orient, simplify
from models.importing.decompose import Decomposition, decompose
from models.importing.labels import Label
from models.importing.mesh_file import collect_references
from models.importing.scan import read_scan
from models.objects.asset import ObjectAsset

DEFAULT_DENSITY_KG_M3 = 400.0
_DECIMALS = 5
_GLOSS = 0.2
# Isoperimetric quotient above which an outline rolls: an octagon has 0.95, a square 0.79.
_ROUND = 0.96
# Raised whenever the same input would give another object.
_VERSION = 1


@dataclass(frozen=True, kw_only=True)
class MeshSettings:
    """How meshes are taken in.

    Attributes:
        scale: Factor that turns their unit into metres.
        up: The axis that points up, "z" or "y".
        density_kg_m3: Density of objects without a figure in the words file.
        decomposition: How finely collision geometry is cut.
    """

    scale: float = 1.0
    up: str = "z"
    density_kg_m3: float = DEFAULT_DENSITY_KG_M3
    decomposition: Decomposition = field(default_factory=Decomposition)


@dataclass(frozen=True, kw_only=True, eq=False)
class ImportedMesh:
    """An imported mesh.

    Attributes:
        asset: The object.
        notes: What the user should know about it, one line each.
    """

    asset: ObjectAsset
    notes: tuple[str, ...]


def mesh_key(path: Path, root: Path, label: Label, settings: MeshSettings) -> str:
    """Hash everything that shapes an imported mesh.

    Args:
        path: The mesh file.
        root: Folder that must contain every file it names.
        label: Its mass or density.
        settings: How it is taken in.

    Returns:
        A SHA-256 in hexadecimal.

    Raises:
        ImportRefusedError: If a file is missing, outside the folder, damaged or too large.
    """
    digest = hashlib.sha256()
    files = collect_references(path, root) | {"": path.read_bytes()}
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    figures = [_VERSION, label.name, label.mass_kg, label.density_kg_m3, asdict(settings)]
    digest.update(json.dumps(figures, sort_keys=True).encode())
    return digest.hexdigest()


def read_mesh_object(
    path: Path,
    root: Path,
    label: Label,
    settings: MeshSettings,
    on_wait: Callable[[], object] = lambda: None,
) -> ImportedMesh:
    """Read a mesh, decimate it, cut it into convex parts, weigh it.

    Args:
        path: OBJ, GLB, PLY or STL file.
        root: Folder that must contain every file it names.
        label: Name, words, weight.
        settings: How it is taken in.
        on_wait: Called about twice a second during the decomposition.

    Returns:
        The object, and notes.

    Raises:
        ImportRefusedError: If it cannot be used; the message says why and what to do.
        MissingPackageError: If a package of the extra `import` is needed and not installed.
    """
    scan = read_scan(path, root, scale=settings.scale, up=settings.up)
    whole = orient(scan.welded())
    light = simplify(whole)
    skin = make_skin(scan, light)
    body, notes = _solid(whole, path)
    density = label.density_kg_m3 or settings.density_kg_m3
    mass = label.mass_kg or density * float(body.volume)
    source = _matter_source(label, settings)
    try:
        parts = decompose(light, settings.decomposition, on_wait)
        low, high = skin.vertices.min(axis=0), skin.vertices.max(axis=0)
        base = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
        asset = ObjectAsset(
            name=label.name,
            family="imported",
            split="imported",
            words=label.words,
            vertices=np.round(skin.vertices - base, _DECIMALS) + 0.0,
            faces=skin.faces.astype(np.int32),
            uv=np.round(np.asarray(skin.uv, float), _DECIMALS),
            texture=np.ascontiguousarray(skin.texture),
            collision=tuple(part.moved(-base) for part in parts),
            mass_kg=mass,
            center_of_mass=np.round(np.asarray(body.center_mass) - base, _DECIMALS + 1) + 0.0,
            inertia=_inertia(body, mass),
            density_kg_m3=mass / float(body.volume),
            matter_source=source,
            rolls=_rolls(body),
            gloss=_GLOSS,
        )
    except ImportRefusedError as error:
        raise ImportRefusedError(f"{path}: {error}") from None
    except AssetError as error:
        raise ImportRefusedError(f"{path} cannot be used: {error}") from None
    return ImportedMesh(asset=asset, notes=notes)


def _solid(whole: trimesh.Trimesh, path: Path) -> tuple[trimesh.Trimesh, tuple[str, ...]]:
    """Return the body that is weighed: the mesh, or its hull if it is not closed."""
    hull = whole.convex_hull
    if hull.volume <= 0:
        raise ImportRefusedError(f"{path} encloses no volume; it must be a body.")
    if whole.is_watertight and whole.is_winding_consistent and whole.volume > 1e-3 * hull.volume:
        return whole, ()
    note = f"{path} is not watertight: mass and inertia are those of its convex hull."
    return hull, (note,)


def _inertia(body: trimesh.Trimesh, mass_kg: float) -> np.ndarray:
    """Return inertia (3, 3) about the centre of mass, kg m^2, evenly filled."""
    inertia = np.asarray(body.moment_inertia) * (mass_kg / float(body.volume))
    return (inertia + inertia.T) / 2


def _matter_source(label: Label, settings: MeshSettings) -> str:
    if label.mass_kg is not None:
        return "mass from the words file"
    if label.density_kg_m3 is not None:
        return "density from the words file"
    return f"assumed density of {settings.density_kg_m3:g} kg/m3"


def _rolls(body: trimesh.Trimesh) -> bool:
    """Tell whether an outline along a principal axis is round."""
    points = np.asarray(body.convex_hull.vertices) @ np.asarray(body.principal_inertia_vectors).T
    for axis in range(3):
        outline = ConvexHull(np.delete(points, axis, axis=1))
        # In the plane, scipy calls the perimeter area and the area volume.
        if 4 * np.pi * outline.volume / outline.area**2 > _ROUND:
            return True
    return False
