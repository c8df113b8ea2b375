"""Objects as MJCF trees for `dm_control.mjcf`.

Contact settings follow the same tabletop tuning for every object: elliptic cone, impratio 10 and
implicitfast at 2 ms are assumed of the scene.
"""

import io

import numpy as np
from dm_control import mjcf
from PIL import Image

from models.objects.asset import ObjectAsset
from models.objects.collision import CollisionPart
from models.objects.mjcf_object import MjcfObject

VISUAL_GROUP = 2
COLLISION_GROUP = 3
# Sliding, torsional and rolling friction. The rolling figure is the lever arm of the rolling
# resistance in metres: 1 mm is a soft ball or a dented can on a table cloth.
FRICTION = (0.7, 0.005, 0.0001)
ROLLING_FRICTION = (0.7, 0.005, 0.001)
# A time constant of four 2 ms steps: stiff enough that objects do not sink into each other, well
# off the stability limit of two steps.
SOLREF = (0.008, 1.0)
CONDIM = 4
ROLLING_CONDIM = 6


def obj_bytes(asset: ObjectAsset) -> bytes:
    """Write the visual mesh as an OBJ file.

    Positions that coincide become one vertex with several texture coordinates, so that normals
    are smooth across texture seams.

    Args:
        asset: The object.

    Returns:
        The file, ASCII, fixed precision.
    """
    positions, index = np.unique(asset.vertices, axis=0, return_inverse=True)
    corners = 1 + np.stack([index.reshape(-1)[asset.faces], asset.faces], axis=2)
    text = _lines("v %.5f %.5f %.5f\n", positions) + _lines("vt %.5f %.5f\n", asset.uv)
    return (text + _lines("f %d/%d %d/%d %d/%d\n", corners)).encode()


def _lines(form: str, table: np.ndarray) -> str:
    """Print rows; one format for all takes a third of the time of one a row."""
    return form * len(table) % tuple(table.ravel().tolist())


def texture_bytes(asset: ObjectAsset) -> bytes:
    """Write the texture as a PNG file."""
    buffer = io.BytesIO()
    # A scene with many objects spends its time here, not on the disk.
    Image.fromarray(asset.texture).save(buffer, format="PNG", compress_level=1)
    return buffer.getvalue()


def build_object(asset: ObjectAsset | MjcfObject, *, name: str | None = None) -> mjcf.RootElement:
    """Describe an object as one body, without a joint.

    The scene attaches it and adds a free joint to the attachment frame. Collision geoms are named
    `collision_0`, `collision_1`, ...; the visual geom `visual` (`visual_0`, `visual_1`, ... for an
    object that came as MJCF, which keeps its own geoms and contact settings); the body `object`.

    Args:
        asset: The object.
        name: Model name, the prefix after attaching; by default the asset's name.

    Returns:
        The tree.
    """
    if isinstance(asset, MjcfObject):
        root = mjcf.from_xml_string(asset.xml, assets=dict(asset.assets))
        root.model = name or asset.name
        return root
    root = mjcf.RootElement(model=name or asset.name)
    root.compiler.angle = "radian"
    body = root.worldbody.add("body", name="object")
    inertia = asset.inertia
    body.add(
        "inertial",
        pos=asset.center_of_mass,
        mass=asset.mass_kg,
        fullinertia=[inertia[k] for k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))],
    )
    _add_visual(root, body, asset)
    for index, part in enumerate(asset.collision):
        _add_collision(root, body, part, index, asset.rolls)
    return root


def _add_visual(root: mjcf.RootElement, body: mjcf.Element, asset: ObjectAsset) -> None:
    """Add texture, material, mesh and the geom that is only seen."""
    texture = root.asset.add(
        "texture", name="texture", type="2d", file=mjcf.Asset(texture_bytes(asset), ".png")
    )
    material = root.asset.add(
        "material",
        name="material",
        texture=texture,
        specular=asset.gloss,
        shininess=0.2 + 0.5 * asset.gloss,
    )
    # Solids of one mesh overlap; the geom has no mass, its volume only has to be well defined.
    mesh = root.asset.add(
        "mesh", name="visual", file=mjcf.Asset(obj_bytes(asset), ".obj"), inertia="shell"
    )
    body.add(
        "geom",
        name="visual",
        type="mesh",
        mesh=mesh,
        material=material,
        group=VISUAL_GROUP,
        contype=0,
        conaffinity=0,
        mass=0,
    )


def _add_collision(
    root: mjcf.RootElement, body: mjcf.Element, part: CollisionPart, index: int, rolls: bool
) -> None:
    """Add one convex part as a geom that is only felt."""
    name = f"collision_{index}"
    geometry = {"type": part.kind, "size": part.size}
    if part.kind == "convex":
        mesh = root.asset.add("mesh", name=name, vertex=part.vertices.ravel(), inertia="convex")
        geometry = {"type": "mesh", "mesh": mesh}
    body.add(
        "geom",
        name=name,
        pos=part.position,
        quat=part.quat_wxyz,
        group=COLLISION_GROUP,
        mass=0,
        condim=ROLLING_CONDIM if rolls else CONDIM,
        friction=ROLLING_FRICTION if rolls else FRICTION,
        solref=SOLREF,
        **geometry,
    )
