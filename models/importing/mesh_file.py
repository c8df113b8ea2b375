"""Cheap checks of mesh files before anything heavy: how many triangles, which other files."""

import io
import json
import os
import re
import struct
from pathlib import Path
from typing import Any

from PIL import Image

from models.errors import ImportRefusedError
from models.importing.paths import resolve_inside

MESH_SUFFIXES = (".obj", ".glb", ".ply", ".stl")
MAX_FACES = 2_000_000
_DRAWN_GLB_EXTENSIONS = {"KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"}
# An option of a texture statement and its numbers, as in `map_Kd -s 1 1 1 texture.png`.
_MAP_OPTION = re.compile(r"^-\w+(\s+(-?[\d.]+|on|off))*\s+")


def collect_references(path: Path, root: Path) -> dict[str, bytes]:
    """Read every file that a mesh file needs besides itself, and check what can be checked.

    Args:
        path: The mesh file.
        root: Folder that must contain everything.

    Returns:
        Content by name as the mesh file has it.

    Raises:
        ImportRefusedError: If a file is missing, outside the folder or damaged, or the mesh has
            more than two million triangles.
    """
    data = path.read_bytes()
    count = count_faces(path, data)
    if count > MAX_FACES:
        raise ImportRefusedError(
            f"{path} has {count} triangles, at most {MAX_FACES} are read; decimate it first."
        )
    if path.suffix.lower() == ".obj":
        return _obj_references(path, data, root)
    if path.suffix.lower() == ".ply":
        return _ply_references(path, data, root)
    return {}


def count_faces(path: Path, data: bytes) -> int:
    """Count the faces of a mesh file without loading it.

    Args:
        path: The file; its suffix tells the format.
        data: Its content.

    Returns:
        The number of faces; polygons count once.

    Raises:
        ImportRefusedError: If the file is not what its suffix says.
    """
    kind = path.suffix.lower()
    if kind == ".obj":
        return data.count(b"\nf ") + data.startswith(b"f ")
    if kind == ".ply":
        match = re.search(rb"element face (\d+)", data[:65536])
        if not data.startswith(b"ply") or match is None:
            raise ImportRefusedError(f"{path} is not a PLY mesh with faces; export it again.")
        return int(match[1])
    if kind == ".stl":
        if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack("<I", data[80:84])[0]:
            return (len(data) - 84) // 50
        return data.count(b"endfacet")
    return _count_glb(path, _glb_json(path, data))


def _glb_json(path: Path, data: bytes) -> dict[str, Any]:
    """Read a GLB's description; refuse what names other files or needs a decoder."""
    try:
        magic, version, _, length, kind = struct.unpack("<4sIII4s", data[:20])
        if magic != b"glTF" or version != 2 or kind != b"JSON":
            raise ValueError("no glTF 2 header")
        tree = json.loads(data[20 : 20 + length])
    except (struct.error, ValueError) as error:
        raise ImportRefusedError(f"{path} is not a GLB file ({error}); export it again.") from None
    for group in ("images", "buffers"):
        for item in tree.get(group, []):
            if "uri" in item and not item["uri"].startswith("data:"):
                raise ImportRefusedError(
                    f"{path} names the file {item['uri']!r}; export the GLB with everything "
                    "embedded."
                )
    needs = set(tree.get("extensionsRequired", [])) - _DRAWN_GLB_EXTENSIONS
    if needs:
        raise ImportRefusedError(
            f"{path} needs the glTF extensions {', '.join(sorted(needs))}; export without them."
        )
    return tree


def _count_glb(path: Path, tree: dict[str, Any]) -> int:
    """Add up the triangles of all meshes."""
    try:
        primitives = [p for mesh in tree.get("meshes", []) for p in mesh["primitives"]]
        picks = [p.get("indices", p["attributes"]["POSITION"]) for p in primitives]
        return sum(int(tree["accessors"][pick]["count"]) // 3 for pick in picks)
    except (KeyError, IndexError, TypeError):
        raise ImportRefusedError(f"{path} has a damaged description; export it again.") from None


def _obj_references(path: Path, data: bytes, root: Path) -> dict[str, bytes]:
    """Follow OBJ -> MTL -> textures."""
    files: dict[str, bytes] = {}
    for line in re.findall(rb"^mtllib[ \t]+(.+?)\s*$", data, re.MULTILINE):
        name = line.decode(errors="replace")
        mtl = resolve_inside(
            name, named_by=path, bases=[path.parent], root=root,
            remedy="put the material file there, or remove the line mtllib.",
        )  # fmt: skip
        files |= _aliases(name, mtl.read_bytes())
        files |= _mtl_textures(mtl, root)
    return files


def _mtl_textures(mtl: Path, root: Path) -> dict[str, bytes]:
    """Read the diffuse textures of a material file."""
    files: dict[str, bytes] = {}
    # Google Scanned Objects keep meshes/model.mtl and materials/textures/texture.png.
    bases = [mtl.parent, mtl.parent.parent / "materials" / "textures"]
    text = mtl.read_text(encoding="utf-8", errors="replace")
    for rest in re.findall(r"^[ \t]*map_Kd[ \t]+(.+?)\s*$", text, re.MULTILINE):
        name = _MAP_OPTION.sub("", rest)
        texture = resolve_inside(
            name, named_by=mtl, bases=bases, root=root, remedy="put the texture there."
        )
        content = texture.read_bytes()
        check_image(texture, content)
        files |= _aliases(name, content) | _aliases(rest, content)
    return files


def _ply_references(path: Path, data: bytes, root: Path) -> dict[str, bytes]:
    """Read the texture that a PLY's comment names."""
    header = data[:65536].split(b"end_header")[0]
    files: dict[str, bytes] = {}
    for line in re.findall(rb"^comment TextureFile[ \t]+(.+?)\s*$", header, re.MULTILINE):
        name = line.decode(errors="replace")
        texture = resolve_inside(
            name, named_by=path, bases=[path.parent], root=root, remedy="put the texture there."
        )
        files |= _aliases(name, texture.read_bytes())
        check_image(texture, files[name])
    return files


def _aliases(name: str, content: bytes) -> dict[str, bytes]:
    """Give a file every name under which a reader may ask for it."""
    plain = name.removeprefix("./")
    return dict.fromkeys((name, plain, os.path.basename(name)), content)


def check_image(path: Path, data: bytes) -> None:
    """Refuse a picture that cannot be decoded.

    Args:
        path: What to call it.
        data: Its content.

    Raises:
        ImportRefusedError: If it is damaged or has more than 178 million pixels.
    """
    try:
        with Image.open(io.BytesIO(data)) as image:
            image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = str(error).split("<")[0].strip()
        raise ImportRefusedError(
            f"Texture {path} cannot be read ({reason}); replace the file."
        ) from None
