"""Makes a scan light enough to render and collide, and keeps how it looks."""

from dataclasses import dataclass

import numpy as np
import trimesh

from models.errors import MissingPackageError
from models.importing.charts import lay_out
from models.importing.scan import Scan, shrink_image
from models.importing.texture import bake

MAX_FACES = 8000
TEXTURE_PX = 512
# Texture coordinates this far outside the picture mean tiles, which a decimated copy cannot have.
_UV_SLACK = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Skin:
    """A textured surface of bounded size.

    Attributes:
        vertices: (V, 3) metres.
        faces: (F, 3) counter-clockwise seen from outside, F <= 8000.
        uv: (V, 2) texture coordinates, v up.
        texture: (H, W, 3) uint8, row 0 at v = 1, no side over 512 px.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    texture: np.ndarray


def orient(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Turn the faces of a mesh outwards.

    Args:
        mesh: The mesh, welded.

    Returns:
        A copy.
    """
    turned = mesh.copy()
    trimesh.repair.fix_normals(turned, multibody=True)
    return turned


def simplify(mesh: trimesh.Trimesh, num_faces: int = MAX_FACES) -> trimesh.Trimesh:
    """Decimate a mesh by collapsing the edges that matter least to its shape.

    Args:
        mesh: The mesh, welded.
        num_faces: Most faces of the result.

    Returns:
        A mesh with at most so many faces; the same one if it has no more.

    Raises:
        MissingPackageError: If fast-simplification is needed and not installed.
    """
    if len(mesh.faces) <= num_faces:
        return mesh
    try:
        import fast_simplification
    except ImportError:
        raise MissingPackageError(
            "fast-simplification is not installed, it decimates meshes; "
            "pip install '.[import]' in a clone"
        ) from None
    vertices, faces, *_ = fast_simplification.simplify(
        np.asarray(mesh.vertices, np.float64),
        np.asarray(mesh.faces, np.int32),
        target_count=num_faces,
    )
    light = trimesh.Trimesh(np.asarray(vertices, float), faces, process=False)
    light.update_faces(light.nondegenerate_faces())
    light.remove_unreferenced_vertices()
    return light


def make_skin(scan: Scan, light: trimesh.Trimesh) -> Skin:
    """Give a decimated scan the colours of the original.

    A scan that is light already, with one picture, keeps its texture coordinates; any other is
    laid out anew.

    Args:
        scan: The original.
        light: Its welded mesh, faces outwards, decimated.

    Returns:
        The surface.
    """
    return _kept(scan, light) or _baked(scan, light)


def _baked(scan: Scan, light: trimesh.Trimesh) -> Skin:
    layout = lay_out(light, TEXTURE_PX)
    texture = bake(scan, layout)
    return Skin(vertices=layout.vertices, faces=layout.faces, uv=layout.uv, texture=texture)


def _kept(scan: Scan, light: trimesh.Trimesh) -> Skin | None:
    """Return the scan as it is, if it can stay so."""
    piece = scan.pieces[0]
    if len(scan.pieces) > 1 or piece.uv is None or piece.image is None:
        return None
    corners = piece.vertices[piece.faces]
    same = np.array_equal(np.sort(_places(corners)), np.sort(_places(light.triangles)))
    plain = np.all(piece.corner_colors == 1.0) and np.all(np.abs(piece.uv - 0.5) <= 0.5 + _UV_SLACK)
    if len(corners) > MAX_FACES or not same or not plain:
        return None
    texture = shrink_image(piece.image, TEXTURE_PX)
    return Skin(vertices=piece.vertices, faces=piece.faces, uv=piece.uv, texture=texture)


def _places(triangles: np.ndarray) -> np.ndarray:
    """Return a number for each (F, 3, 3) triangle that turns sign with its orientation."""
    first, second, third = np.moveaxis(np.asarray(triangles, float), 1, 0)
    weights = np.array([3.0, 5.0, 7.0])
    return np.round(np.cross(second - first, third - first) @ weights * 1e9)
