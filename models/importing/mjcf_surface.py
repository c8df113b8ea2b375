"""Geometry and pictures of a compiled MuJoCo model: triangles of geoms, OBJ and PNG files."""

import io

import mujoco
import numpy as np
import trimesh
from PIL import Image

_TEXTURE_PX = 512
_NUM_SIDES = 32
_CUBE = int(mujoco.mjtTexture.mjTEXTURE_CUBE)
_MODES = {1: "L", 3: "RGB", 4: "RGBA"}


def geom_surface(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangulate a geom.

    Args:
        model: The model.
        geom: Index of a mesh, box, sphere, ellipsoid, capsule or cylinder.

    Returns:
        Vertices (V, 3) in the geom's frame, metres, and faces (F, 3).
    """
    types = mujoco.mjtGeom
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case types.mjGEOM_MESH:
            return mesh_surface(model, int(model.geom_dataid[geom]))
        case types.mjGEOM_BOX:
            solid = trimesh.creation.box(2 * size)
        case types.mjGEOM_CYLINDER:
            solid = trimesh.creation.cylinder(size[0], 2 * size[1], _NUM_SIDES)
        case types.mjGEOM_CAPSULE:
            solid = trimesh.creation.capsule(2 * size[1], size[0], count=[_NUM_SIDES, 16])
        case _:
            solid = trimesh.creation.icosphere(subdivisions=3)
            solid.apply_scale(size if size[1] > 0 else size[0])
    return np.asarray(solid.vertices, float), np.asarray(solid.faces)


def _slice(starts: np.ndarray, counts: np.ndarray, index: int) -> slice:
    return slice(int(starts[index]), int(starts[index] + counts[index]))


def mesh_surface(model: mujoco.MjModel, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of a compiled mesh.

    Args:
        model: The model.
        mesh: Index of the mesh.

    Returns:
        Vertices (V, 3) in the mesh's frame, metres, and faces (F, 3).
    """
    vertices = model.mesh_vert[_slice(model.mesh_vertadr, model.mesh_vertnum, mesh)]
    faces = model.mesh_face[_slice(model.mesh_faceadr, model.mesh_facenum, mesh)]
    return vertices.astype(float), faces.copy()


def mesh_bytes(model: mujoco.MjModel, mesh: int) -> bytes:
    """Write a compiled mesh as an OBJ file with its normals and texture coordinates.

    Args:
        model: The model.
        mesh: Index of the mesh.

    Returns:
        The file, ASCII; positions to 0.1 micrometre.
    """
    vertices, faces = mesh_surface(model, mesh)
    rows = _slice(model.mesh_faceadr, model.mesh_facenum, mesh)
    normals = model.mesh_normal[_slice(model.mesh_normaladr, model.mesh_normalnum, mesh)]
    columns = [faces, model.mesh_facenormal[rows]]
    text = _lines("v %.7f %.7f %.7f\n", vertices) + _lines("vn %.5f %.5f %.5f\n", normals)
    corner = "%d//%d"
    if model.mesh_texcoordadr[mesh] >= 0:
        texcoords = _slice(model.mesh_texcoordadr, model.mesh_texcoordnum, mesh)
        # The compiled model counts v from the top, a file from the bottom.
        uv = model.mesh_texcoord[texcoords].astype(float) * (1, -1) + (0, 1)
        text += _lines("vt %.6f %.6f\n", uv)
        columns.insert(1, model.mesh_facetexcoord[rows])
        corner = "%d/%d/%d"
    table = 1 + np.stack(columns, axis=2).reshape(len(faces), -1)
    return (text + _lines(f"f {corner} {corner} {corner}\n", table)).encode()


def _lines(form: str, table: np.ndarray) -> str:
    return form * len(table) % tuple(np.ravel(table).tolist())


def is_full_cube(model: mujoco.MjModel, texture: int) -> bool:
    """Tell whether a texture has six faces; a cube map may also repeat one picture on all six.

    Args:
        model: The model.
        texture: Index of the texture.

    Returns:
        True if it has six.
    """
    is_cube = model.tex_type[texture] == _CUBE
    return bool(is_cube and model.tex_height[texture] == 6 * model.tex_width[texture])


def texture_png(model: mujoco.MjModel, texture: int) -> bytes:
    """Write a compiled texture as a PNG file of at most 512 pixels a side.

    Args:
        model: The model.
        texture: Index of the texture.

    Returns:
        The file; the six faces of a cube map stand below each other.
    """
    rows, columns = int(model.tex_height[texture]), int(model.tex_width[texture])
    channels = int(model.tex_nchannel[texture])
    start = int(model.tex_adr[texture])
    data = np.asarray(model.tex_data[start : start + rows * columns * channels])
    data = data.reshape((rows, columns) if channels == 1 else (rows, columns, channels))
    image = Image.fromarray(np.ascontiguousarray(data), _MODES[channels])
    faces = 6 if is_full_cube(model, texture) else 1
    factor = _TEXTURE_PX / max(columns, rows // faces)
    if factor < 1:
        height = faces * max(1, round(rows // faces * factor))
        image = image.resize((max(1, round(columns * factor)), height), Image.Resampling.BOX)
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", compress_level=6)
    return buffer.getvalue()
