"""Writes a compiled object as an MJCF document of one body, in the catalogue's conventions.

Poses, sizes, defaults and file formats have been resolved by MuJoCo itself; what is written says
the same without any of them.
"""

import mujoco
import numpy as np
from lxml import etree

from models.importing.mjcf_surface import is_full_cube, mesh_bytes, texture_png
from models.objects.mjcf_builder import (
    COLLISION_GROUP,
    ROLLING_CONDIM,
    ROLLING_FRICTION,
    SOLREF,
    VISUAL_GROUP,
)

_CUBE = int(mujoco.mjtTexture.mjTEXTURE_CUBE)
_COLOR_ROLES = (int(mujoco.mjtTextureRole.mjTEXROLE_RGB), int(mujoco.mjtTextureRole.mjTEXROLE_RGBA))
_COLOR_SPACES = ("auto", "linear", "sRGB")
_NUM_SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "ellipsoid": 3, "capsule": 2, "mesh": 0}
# MuJoCo's own defaults: settings that nobody chose give way to those of our objects.
_UNCHOSEN_FRICTION, _UNCHOSEN_SOLREF = (1, 0.005, 0.0001), (0.02, 1)
_UNCHOSEN_SOLIMP = (0.9, 0.95, 0.001, 0.5, 2)


def write_object(
    data: mujoco.MjData,
    *,
    visual: list[int],
    collision: list[int],
    base: np.ndarray,
    mass_kg: float,
    center_of_mass: np.ndarray,
    inertia: np.ndarray,
) -> tuple[str, dict[str, bytes]]:
    """Describe geoms of a model as one body.

    Args:
        data: State after `mj_kinematics`.
        visual: Geoms that are seen.
        collision: Geoms that are felt.
        base: (3,) origin of the object's frame in the world, metres.
        mass_kg: Mass.
        center_of_mass: (3,) in the object's frame, metres.
        inertia: (3, 3) about the centre of mass, kg m^2.

    Returns:
        The document, and the files that it names.
    """
    writer = _Writer(data, base)
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    etree.SubElement(
        writer.body, "inertial", pos=_text(center_of_mass), mass=_text([mass_kg]),
        fullinertia=_text([inertia[pair] for pair in pairs]),
    )  # fmt: skip
    for index, geom in enumerate(visual):
        writer.add_visual(geom, f"visual_{index}")
    for index, geom in enumerate(collision):
        writer.add_collision(geom, f"collision_{index}")
    etree.indent(writer.root)
    return etree.tostring(writer.root, encoding="unicode"), writer.files


def _text(values: object) -> str:
    return " ".join(f"{value + 0.0:.9g}" for value in np.ravel(np.asarray(values, float)).tolist())


class _Writer:
    """A document under construction."""

    def __init__(self, data: mujoco.MjData, base: np.ndarray) -> None:
        self.model, self.data, self.base = data.model, data, base
        self.files: dict[str, bytes] = {}
        self.root = etree.Element("mujoco")
        etree.SubElement(self.root, "compiler", angle="radian")
        self.asset = etree.SubElement(self.root, "asset")
        world = etree.SubElement(self.root, "worldbody")
        self.body = etree.SubElement(world, "body", name="object")

    def add_visual(self, geom: int, name: str) -> None:
        """Add a geom that is only seen."""
        element = self._add_geom(geom, name, VISUAL_GROUP)
        for key in ("contype", "conaffinity", "mass"):
            element.set(key, "0")
        material = int(self.model.geom_matid[geom])
        if material >= 0:
            element.set("material", self._material(material))
        gray = (0.5, 0.5, 0.5, 1)
        if material < 0 or not np.allclose(self.model.geom_rgba[geom], gray):
            element.set("rgba", _text(self.model.geom_rgba[geom]))

    def add_collision(self, geom: int, name: str) -> None:
        """Add a geom that is only felt, with its contact settings where somebody chose them."""
        model = self.model
        element = self._add_geom(geom, name, COLLISION_GROUP)
        condim, friction = int(model.geom_condim[geom]), model.geom_friction[geom].copy()
        if np.allclose(friction, _UNCHOSEN_FRICTION):
            friction[:] = ROLLING_FRICTION
        if condim in (3, 4):
            # Without rolling friction, round objects never come to rest, and cans of a thousand
            # triangles rock on. What the author's condim left without effect is ours to choose.
            friction[condim - 2 :] = ROLLING_FRICTION[condim - 2 :]
            condim = ROLLING_CONDIM
        solref = model.geom_solref[geom]
        element.set("condim", str(condim))
        element.set("friction", _text(friction))
        element.set("solref", _text(SOLREF if np.allclose(solref, _UNCHOSEN_SOLREF) else solref))
        if not np.allclose(model.geom_solimp[geom], _UNCHOSEN_SOLIMP):
            element.set("solimp", _text(model.geom_solimp[geom]))
        element.set("mass", "0")

    def _add_geom(self, geom: int, name: str, group: int) -> etree._Element:
        """Add type, size and pose."""
        kind = mujoco.mjtGeom(self.model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, self.data.geom_xmat[geom])
        element = etree.SubElement(
            self.body, "geom", name=name, type=kind, group=str(group), quat=_text(quat.round(9)),
            pos=_text((self.data.geom_xpos[geom] - self.base).round(8)),
        )  # fmt: skip
        if kind == "mesh":
            element.set("mesh", self._mesh(int(self.model.geom_dataid[geom]), group))
        else:
            element.set("size", _text(self.model.geom_size[geom][: _NUM_SIZES[kind]].round(8)))
        return element

    def _mesh(self, mesh: int, group: int) -> str:
        """Add a mesh once for each use; solids that are only seen need no volume."""
        seen = group == VISUAL_GROUP
        name = f"{'seen' if seen else 'felt'}_{mesh}"
        if f"{name}.obj" not in self.files:
            self.files[f"{name}.obj"] = mesh_bytes(self.model, mesh)
            etree.SubElement(
                self.asset, "mesh", name=name, file=f"{name}.obj",
                inertia="shell" if seen else "convex",
            )  # fmt: skip
        return name

    def _material(self, material: int) -> str:
        """Add a material, once, with its colour texture."""
        model, name = self.model, f"material_{material}"
        if self.asset.find(f"material[@name='{name}']") is not None:
            return name
        texture = max(int(model.mat_texid[material, role]) for role in _COLOR_ROLES)
        used = {} if texture < 0 else {"texture": self._texture(texture)}
        etree.SubElement(
            self.asset, "material", name=name, **used,
            rgba=_text(model.mat_rgba[material]),
            texrepeat=_text(model.mat_texrepeat[material]),
            texuniform="true" if model.mat_texuniform[material] else "false",
            emission=_text(model.mat_emission[material]),
            specular=_text(model.mat_specular[material]),
            shininess=_text(model.mat_shininess[material]),
        )  # fmt: skip
        return name

    def _texture(self, texture: int) -> str:
        """Add a texture, once."""
        model, name = self.model, f"texture_{texture}"
        if f"{name}.png" in self.files:
            return name
        self.files[f"{name}.png"] = texture_png(model, texture)
        cube = model.tex_type[texture] == _CUBE
        sides = {"gridsize": "6 1", "gridlayout": "RLUDFB"}
        layout = sides if is_full_cube(model, texture) else {}
        etree.SubElement(
            self.asset, "texture", name=name, file=f"{name}.png",
            type="cube" if cube else "2d", nchannel=str(int(model.tex_nchannel[texture])),
            colorspace=_COLOR_SPACES[int(model.tex_colorspace[texture])], **layout,
        )  # fmt: skip
        return name
