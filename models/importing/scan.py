"""`Scan`, a textured mesh as it came, and how one is read and checked."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from models.errors import ImportRefusedError
from models.importing.mesh_file import MAX_FACES, collect_references

MIN_SIZE_M, MAX_SIZE_M = 0.003, 0.4
_GRAY = (0.6, 0.6, 0.6)
# Finer than any texture that we write by far, and a quarter of a 4096 px scan's memory.
_WORKING_PX = 2048


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A part of a scan with one material.

    Attributes:
        vertices: (V, 3) metres.
        faces: (F, 3) vertex indices.
        uv: (V, 2) texture coordinates, v up, or None.
        image: (H, W, 3) uint8 with row 0 at v = 1, or None.
        corner_colors: (F, 3, 3) in 0..1: the colour at every corner; multiplies the image.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None
    image: np.ndarray | None
    corner_colors: np.ndarray

    def colors_at(self, face: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Look up colours on the surface.

        Args:
            face: (N,) face indices.
            weights: (N, 3) barycentric coordinates.

        Returns:
            (N, 3) in 0..1.
        """
        colors = np.einsum("nk,nkc->nc", weights, self.corner_colors[face])
        if self.uv is None or self.image is None:
            return colors
        uv = np.einsum("nk,nkc->nc", weights, self.uv[self.faces[face]]) % 1.0
        rows, columns = self.image.shape[:2]
        row = np.minimum(((1 - uv[:, 1]) * rows).astype(int), rows - 1)
        column = np.minimum((uv[:, 0] * columns).astype(int), columns - 1)
        return colors * self.image[row, column] / 255.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """A mesh in its natural rest pose, z up, in metres.

    Attributes:
        pieces: Parts by material.
    """

    pieces: tuple[Piece, ...]

    def welded(self) -> trimesh.Trimesh:
        """Join all pieces, and the vertices that texture seams keep apart."""
        starts = np.cumsum([0, *(len(piece.vertices) for piece in self.pieces)])
        faces = [p.faces + s for p, s in zip(self.pieces, starts[:-1], strict=True)]
        vertices = np.concatenate([piece.vertices for piece in self.pieces])
        mesh = trimesh.Trimesh(vertices, np.concatenate(faces), process=False)
        mesh.merge_vertices(digits_vertex=6)
        mesh.update_faces(mesh.nondegenerate_faces())
        mesh.remove_unreferenced_vertices()
        return mesh


def read_scan(path: Path, root: Path, *, scale: float = 1.0, up: str = "z") -> Scan:
    """Read a mesh file with its textures and check that it can be an object on a table.

    Args:
        path: OBJ, GLB, PLY or STL file.
        root: Folder that must contain every file it names.
        scale: Factor that turns its unit into metres.
        up: The axis that points up, "z" or "y".

    Returns:
        The scan.

    Raises:
        ImportRefusedError: If it cannot be used; the message says why and what to do.
    """
    files = collect_references(path, root)
    try:
        scene = trimesh.load_scene(
            io.BytesIO(path.read_bytes()),
            file_type=path.suffix.lower().removeprefix("."),
            resolver=files,
            process=False,
        )
        meshes = [item for item in scene.dump() if isinstance(item, trimesh.Trimesh)]
        pieces = [_piece(mesh, scale, up) for mesh in meshes if len(mesh.faces)]
    except Exception as error:
        # Readers of other people's formats fail with whatever comes to hand.
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise ImportRefusedError(f"{path} cannot be read ({reason}); export it again.") from None
    scan = Scan(pieces=tuple(pieces))
    _check(scan, path)
    return scan


def _piece(mesh: trimesh.Trimesh, scale: float, up: str) -> Piece:
    """Take geometry and colours out of a loaded mesh."""
    vertices = np.asarray(mesh.vertices, float) * scale
    if up == "y":
        vertices = np.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], axis=1)
    faces = np.asarray(mesh.faces)
    uv, image, corners = None, None, np.broadcast_to(_GRAY, (len(faces), 3, 3))
    visual: Any = mesh.visual
    if visual.kind == "texture":
        uv = None if visual.uv is None else np.asarray(visual.uv, float)[:, :2]
        image, tint = _material(visual.material)
        corners = np.broadcast_to(_GRAY if tint is None else tint, corners.shape)
    elif visual.kind == "vertex":
        corners = np.asarray(visual.vertex_colors)[:, :3][faces] / 255.0
    elif visual.kind == "face":
        corners = np.repeat(np.asarray(visual.face_colors)[:, None, :3], 3, axis=1) / 255.0
    if uv is None or image is None:
        uv = image = None
    return Piece(vertices=vertices, faces=faces, uv=uv, image=image, corner_colors=corners)


def _material(material: object) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the base texture, shrunk to a workable size, and the base colour (3,) in 0..1."""
    picture = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    factor = getattr(material, "baseColorFactor", None)
    if picture is None:
        tint = getattr(material, "main_color", None) if factor is None else factor
        return None, None if tint is None else _unit(tint)
    shrink = max(1, -(-max(picture.size) // _WORKING_PX))
    image = picture.convert("RGB")
    image = image.reduce(shrink) if shrink > 1 else image
    # An MTL's Kd beside a map is mostly an exporter's leftover (0.8), and scans are lit already.
    return np.asarray(image), np.ones(3) if factor is None else _unit(factor)


def _unit(color: object) -> np.ndarray:
    """Bring a colour, as bytes or as fractions, to (3,) in 0..1."""
    values = np.asarray(color)
    return values[:3].astype(float) / (255.0 if values.dtype.kind in "ui" else 1.0)


def _check(scan: Scan, path: Path) -> None:
    """Refuse what cannot be an object on a table."""
    count = sum(len(piece.faces) for piece in scan.pieces)
    if count == 0:
        raise ImportRefusedError(f"{path} has no triangles; it must be a mesh, not points.")
    if count > MAX_FACES:
        raise ImportRefusedError(
            f"{path} has {count} triangles, at most {MAX_FACES} are read; decimate it first."
        )
    used = np.concatenate([piece.vertices[piece.faces].reshape(-1, 3) for piece in scan.pieces])
    if not np.all(np.isfinite(used)):
        raise ImportRefusedError(f"{path} has vertices that are not finite; export it again.")
    extents = np.ptp(used, axis=0)
    check_size(extents, path)
    if extents.min() <= 1e-6 * extents.max() or scan.welded().area <= 1e-6 * extents.max() ** 2:
        raise ImportRefusedError(
            f"{path} has no thickness or no area (extents {_mm(extents)} mm); it must be a body."
        )


def check_size(extents: np.ndarray, path: Path) -> None:
    """Refuse an object that is not between 3 and 400 mm, naming the likely unit.

    Args:
        extents: (3,) of its bounding box, metres.
        path: What to call it.

    Raises:
        ImportRefusedError: If the largest extent is out of bounds.
    """
    size = float(extents.max())
    if MIN_SIZE_M <= size <= MAX_SIZE_M:
        return
    if MIN_SIZE_M <= size / 1000 <= MAX_SIZE_M and size > 3:
        advice = "its unit seems to be the millimetre: add --scale 0.001"
    else:
        advice = "expected 0.003 to 0.4 m; set the unit with --scale if it is not the metre"
    raise ImportRefusedError(f"{path} is {size:.4g} m large; {advice}.")


def _mm(extents: np.ndarray) -> str:
    return " x ".join(f"{1000 * value:.3g}" for value in extents)


def shrink_image(image: np.ndarray, largest_px: int) -> np.ndarray:
    """Scale a picture down so that no side exceeds a limit.

    Args:
        image: (H, W, 3) uint8.
        largest_px: The limit.

    Returns:
        (h, w, 3) uint8; the same picture if it is small enough.
    """
    rows, columns = image.shape[:2]
    factor = largest_px / max(rows, columns)
    if factor >= 1:
        return image
    size = (max(1, round(columns * factor)), max(1, round(rows * factor)))
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))
