"""Reads other people's MJCF without trusting it: no entities, no includes, no way out.

What describes a rigid object stays (compiler, defaults, meshes, textures, materials, bodies and
geoms); sites, cameras, sensors and options are dropped; what cannot be a rigid object is refused.
"""

import io
import os
import posixpath
from dataclasses import dataclass
from pathlib import Path

from lxml import etree
from PIL import Image

from models.errors import ImportRefusedError
from models.importing.mesh_file import MAX_FACES, check_image, count_faces
from models.importing.paths import resolve_inside

_MAX_BYTES = 8_000_000
_MAX_TEXTURE_PX = 8192
_COMPILER = {
    "angle", "eulerseq", "autolimits", "fitaabb", "inertiafromgeom", "inertiagrouprange",
    "settotalmass", "balanceinertia", "boundmass", "boundinertia",
}  # fmt: skip
_SECTIONS = {"compiler", "default", "asset", "worldbody"}
_DROPPED = ("site", "camera", "light")
_REFUSED = (
    "include", "plugin", "hfield", "skin", "model", "attach", "replicate", "composite", "flexcomp",
)  # fmt: skip
# robosuite and LIBERO merge their objects, marked by these sites, into a document with radians.
_ROBOSUITE_SITES = {"bottom_site", "top_site", "horizontal_radius_site"}


@dataclass(frozen=True, kw_only=True)
class Document:
    """An MJCF document that is complete in itself.

    Attributes:
        xml: The text; its files have the names in `files`.
        files: Content of meshes and textures.
    """

    xml: str
    files: dict[str, bytes]


def _parser_options() -> dict[str, bool]:
    return {
        "resolve_entities": False,
        "load_dtd": False,
        "no_network": True,
        "huge_tree": False,
        "remove_comments": True,
        "remove_pis": True,
    }


def is_mjcf(path: Path) -> bool:
    """Tell whether a file is an MJCF document: `.xml`, and the root element is `<mujoco>`.

    Args:
        path: The file; it may be broken further down.

    Returns:
        True if so.
    """
    if path.suffix.lower() != ".xml" or not path.is_file():
        return False
    parser = etree.XMLPullParser(events=("start",), **_parser_options())
    try:
        with path.open("rb") as file:
            parser.feed(file.read(65536))
    except (OSError, etree.XMLSyntaxError):
        pass
    for _, element in parser.read_events():
        return element.tag == "mujoco"
    return False


def read_document(path: Path, root: Path) -> Document:
    """Read an MJCF document with the files that it names.

    Args:
        path: The document.
        root: Folder that must contain every file.

    Returns:
        The document, reduced to what a rigid object has.

    Raises:
        ImportRefusedError: If it cannot be used; the message says why and what to do.
    """
    tree = _parse(path)
    _refuse_foreign(tree, path)
    settings = _settings(tree)
    _reduce(tree, settings)
    files: dict[str, bytes] = {}
    for element in tree.iter("mesh", "texture"):
        _collect(element, files, settings, path, root)
    _check_no_other_files(tree, files, path)
    return Document(xml=etree.tostring(tree, encoding="unicode"), files=files)


def _parse(path: Path) -> etree._Element:
    data = path.read_bytes()
    if len(data) > _MAX_BYTES:
        raise ImportRefusedError(
            f"{path} has {len(data)} bytes of XML, at most {_MAX_BYTES} are read; keep meshes in "
            "files of their own."
        )
    try:
        tree = etree.fromstring(data, etree.XMLParser(**_parser_options()))
    except etree.XMLSyntaxError as error:
        raise ImportRefusedError(f"{path} is not well-formed XML: {error.msg}; fix it.") from None
    if tree.getroottree().docinfo.doctype:
        raise ImportRefusedError(f"{path} has a DOCTYPE, which MJCF does not need; remove it.")
    if tree.tag != "mujoco":
        raise ImportRefusedError(f"{path} is <{tree.tag}>, expected an MJCF document, <mujoco>.")
    return tree


def _refuse_foreign(tree: etree._Element, path: Path) -> None:
    """Refuse elements that are no part of a rigid object, or would read further files."""
    for element in tree.iter(*_REFUSED):
        if element.tag == "include":
            raise ImportRefusedError(
                f"{path} includes {element.get('file')!r}; save it as one document without "
                "<include>."
            )
        raise ImportRefusedError(
            f"{path} has <{element.tag}> in line {element.sourceline}; only rigid objects of "
            "meshes and primitives are imported."
        )


def _settings(tree: etree._Element) -> dict[str, str]:
    """Merge the attributes of all compiler elements."""
    settings: dict[str, str] = {}
    for element in tree.findall("compiler"):
        settings |= {str(k): str(v) for k, v in element.attrib.items()}
    sites = {site.get("name") for site in tree.iter("site")}
    if sites >= _ROBOSUITE_SITES:
        settings.setdefault("angle", "radian")
    return settings


def _reduce(tree: etree._Element, settings: dict[str, str]) -> None:
    """Drop everything that a rigid object does without."""
    for element in list(tree):
        if element.tag not in _SECTIONS or element.tag == "compiler":
            tree.remove(element)
    for section in tree.findall("worldbody"):
        for element in list(section.iter(*_DROPPED)):
            element.getparent().remove(element)
    kept = {key: value for key, value in settings.items() if key in _COMPILER}
    tree.insert(0, etree.Element("compiler", kept))
    tree.attrib.clear()


def _collect(
    element: etree._Element, files: dict[str, bytes], settings: dict[str, str], path: Path,
    root: Path,
) -> None:  # fmt: skip
    """Read the files of one mesh or texture, and give them names of our own."""
    kind = str(element.tag)
    _check_computed(element, path)
    named = sorted(str(key) for key in element.attrib if str(key).startswith("file"))
    for key in named:
        reference = str(element.get(key))
        if key == "file" and element.getparent().tag == "asset" and not element.get("name"):
            element.set("name", Path(reference.replace("\\", "/")).stem)
        file = resolve_inside(
            _within(reference, kind, settings), named_by=path, bases=[path.parent], root=root,
            remedy=f"put the {kind} there.",
        )  # fmt: skip
        content = _read_mesh(file) if kind == "mesh" else _read_texture(file)
        suffix = file.suffix.lower() if kind == "mesh" else ".png"
        name = f"{kind}_{len(files)}{suffix}"
        files[name] = content
        element.set(key, name)
        element.attrib.pop("content_type", None)


def _within(reference: str, kind: str, settings: dict[str, str]) -> str:
    """Prefix a file's name with the folder of its kind, as MuJoCo does."""
    tidy = reference.replace("\\", "/")
    if settings.get("strippath") == "true":
        tidy = posixpath.basename(tidy)
    folder = settings.get(f"{kind}dir", settings.get("assetdir", ""))
    return os.path.join(folder, tidy) if folder else reference


def _read_mesh(file: Path) -> bytes:
    data = file.read_bytes()
    if file.suffix.lower() in (".obj", ".stl"):
        count = count_faces(file, data)
        if count > MAX_FACES:
            raise ImportRefusedError(
                f"{file} has {count} triangles, at most {MAX_FACES} are read; decimate it first."
            )
    return data


def _read_texture(file: Path) -> bytes:
    """Read a picture; MuJoCo itself reads nothing but PNG."""
    data = file.read_bytes()
    check_image(file, data)
    with Image.open(io.BytesIO(data)) as image:
        if image.format == "PNG":
            return data
        buffer = io.BytesIO()
        image.convert("RGB").save(buffer, format="PNG", compress_level=1)
        return buffer.getvalue()


def _check_computed(element: etree._Element, path: Path) -> None:
    """Refuse meshes and textures computed from numbers that may fill the memory."""
    if element.tag == "mesh" and element.get("builtin"):
        raise ImportRefusedError(
            f"{path} computes the mesh {element.get('name')!r} "
            f"(builtin={element.get('builtin')!r}); save it to a file."
        )
    for attribute in ("width", "height"):
        text = str(element.get(attribute, "0"))
        if not text.strip().isdigit() or int(text) > _MAX_TEXTURE_PX:
            raise ImportRefusedError(
                f"{path} has a texture of {attribute} {text!r}; expected at most {_MAX_TEXTURE_PX}."
            )


def _check_no_other_files(tree: etree._Element, files: dict[str, bytes], path: Path) -> None:
    for element in tree.iter():
        for key, value in element.attrib.items():
            if str(key).startswith("file") and value not in files:
                raise ImportRefusedError(
                    f"{path} names the file {value!r} in <{element.tag}>; only meshes and textures "
                    "may have files."
                )
