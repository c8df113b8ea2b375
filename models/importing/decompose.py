"""Convex decomposition of a mesh, with coacd, remembered on disk.

The method is X. Wei et al., "Approximate Convex Decomposition for 3D Meshes with Collision-Aware
Concavity and Tree Search", SIGGRAPH 2022, https://github.com/SarahWeiii/CoACD. It takes about a
minute an object, so its results are kept in the cache directory of the catalogue.
"""

import hashlib
import importlib.util
import io
import json
import threading
import zipfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import trimesh

from models.errors import ImportRefusedError, MissingPackageError
from models.importing.store import write_atomically
from models.objects.cache import cache_dir
from models.objects.collision import MAX_VERTICES, CollisionPart, convex

PACKAGE = "coacd"
# A body that fills this much of its hull is its hull.
_CONVEX_FILL = 0.97
# Splinters of less than this fraction of the object's hull carry no contact.
_LEAST_VOLUME = 1e-5
_POLL_S = 0.5
_VERSION = 1


@dataclass(frozen=True, kw_only=True)
class Decomposition:
    """How finely to cut; the defaults but for the limits are coacd's own.

    Attributes:
        threshold: Concavity that may remain in a part, 0.01 to 1.
        max_parts: Most parts.
        preprocess_resolution: Voxels along an edge when a mesh that is not closed is closed.
        mcts_iterations: Search effort a cut.
        resolution: Points sampled to measure concavity.
        seed: Seed of the search.
    """

    threshold: float = 0.05
    max_parts: int = 24
    preprocess_resolution: int = 50
    mcts_iterations: int = 150
    resolution: int = 2000
    seed: int = 0


def require_coacd() -> None:
    """Check that coacd is installed.

    Raises:
        MissingPackageError: If it is not.
    """
    if importlib.util.find_spec(PACKAGE) is None:
        raise MissingPackageError(
            "coacd is not installed, it cuts meshes into convex parts; "
            "pip install '.[import]' in a clone"
        )


def decompose(
    mesh: trimesh.Trimesh, settings: Decomposition, on_wait: Callable[[], object] = lambda: None
) -> tuple[CollisionPart, ...]:
    """Cover a mesh with convex parts.

    Args:
        mesh: The mesh, welded, metres.
        settings: How finely.
        on_wait: Called about twice a second while coacd works.

    Returns:
        The parts, of at most 32 vertices each; a convex body is one part.

    Raises:
        MissingPackageError: If coacd is needed and not installed.
        ImportRefusedError: If coacd finds no body in the mesh.
    """
    hull = mesh.convex_hull
    if mesh.is_watertight and mesh.volume >= _CONVEX_FILL * hull.volume:
        return (convex(_few_vertices(hull)),)
    path = _cache_path(mesh, settings)
    clouds = _read_clouds(path)
    if clouds is None:
        require_coacd()
        clouds = _run_patiently(mesh, settings, on_wait)
        _remember(path, clouds)
    hulls = [h for h in map(_hull, clouds) if h is not None]
    solid = [h for h in hulls if h.volume > _LEAST_VOLUME * hull.volume]
    if not solid:
        raise ImportRefusedError("coacd finds no body in the mesh; close it or thicken it.")
    return tuple(convex(_few_vertices(h)) for h in solid)


def _hull(cloud: np.ndarray) -> trimesh.Trimesh | None:
    """Return the hull of points, or None if they are flat."""
    try:
        return trimesh.convex.convex_hull(cloud)
    except (ValueError, IndexError, trimesh.convex.QhullError):
        return None


def _few_vertices(hull: trimesh.Trimesh) -> np.ndarray:
    """Choose at most 32 corners of a hull: each next one is the farthest outside those chosen."""
    vertices = np.asarray(hull.vertices)
    if len(vertices) <= MAX_VERTICES:
        return vertices
    ends = np.concatenate([vertices.argmin(axis=0), vertices.argmax(axis=0)])
    chosen = list(dict.fromkeys(int(end) for end in ends))
    while len(chosen) < MAX_VERTICES:
        inner = _hull(vertices[chosen])
        if inner is None:
            gaps = np.linalg.norm(vertices[:, None] - vertices[chosen], axis=2).min(axis=1)
        else:
            planes = np.asarray(inner.face_normals), np.asarray(inner.triangles[:, 0])
            heights = vertices @ planes[0].T - np.einsum("fk,fk->f", *planes)
            gaps = heights.max(axis=1)
        gaps[chosen] = -np.inf
        chosen.append(int(gaps.argmax()))
    return vertices[chosen]


def _run_patiently(
    mesh: trimesh.Trimesh, settings: Decomposition, on_wait: Callable[[], object]
) -> list[np.ndarray]:
    """Run coacd in a thread: it neither reports progress nor lets itself be interrupted."""
    result: list[list[np.ndarray]] = []
    # A daemon: Ctrl-C leaves the program without waiting for it.
    worker = threading.Thread(target=lambda: result.append(_run(mesh, settings)), daemon=True)
    worker.start()
    while worker.is_alive():
        worker.join(_POLL_S)
        on_wait()
    if not result:
        raise ImportRefusedError("coacd failed on the mesh; close it or simplify it.")
    return result[0]


def _run(mesh: trimesh.Trimesh, settings: Decomposition) -> list[np.ndarray]:
    """Run coacd; return the points of each part."""
    import coacd

    coacd.set_log_level("error")
    parts = coacd.run_coacd(
        coacd.Mesh(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32)),
        threshold=settings.threshold,
        max_convex_hull=settings.max_parts,
        preprocess_resolution=settings.preprocess_resolution,
        mcts_iterations=settings.mcts_iterations,
        resolution=settings.resolution,
        decimate=True,
        max_ch_vertex=MAX_VERTICES,
        seed=settings.seed,
    )
    return [np.asarray(vertices, float) for vertices, _ in parts]


def _cache_path(mesh: trimesh.Trimesh, settings: Decomposition) -> Path:
    digest = hashlib.sha256(json.dumps([_VERSION, asdict(settings)], sort_keys=True).encode())
    digest.update(np.asarray(mesh.vertices, np.float64).tobytes())
    digest.update(np.asarray(mesh.faces, np.int64).tobytes())
    return cache_dir() / "decompositions" / f"{digest.hexdigest()[:32]}.npz"


def _remember(path: Path, clouds: list[np.ndarray]) -> None:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, *clouds)
    try:
        write_atomically(path, buffer.getvalue())
    except OSError:
        # A read-only home must not keep anyone from importing.
        pass


def _read_clouds(path: Path) -> list[np.ndarray] | None:
    """Return a remembered result; a damaged one is worth no more than a missing one."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return [archive[f"arr_{index}"] for index in range(len(archive.files))]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
