"""`ObjectAsset`, the finished description of an object, and how it is put together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from models.errors import AssetError
from models.objects.atlas import Panel, Solid, join_panels
from models.objects.collision import CollisionPart
from models.objects.surface import join
from models.objects.words import ObjectWords

# Positions are stored to 10 micrometres: far below what a camera sees, and the same on every
# machine whatever its last bits of trigonometry.
_DECIMALS = 5
_UV_DECIMALS = 5
_SIGNIFICANT = 6


@dataclass(frozen=True, kw_only=True)
class Matter:
    """What an object weighs, and how we know. Exactly one of the two figures is given.

    Attributes:
        source: Where the figure comes from.
        mass_kg: Mass of the whole object.
        density_kg_m3: Density of the solid.
    """

    source: str
    mass_kg: float | None = None
    density_kg_m3: float | None = None

    def __post_init__(self) -> None:
        """Check that exactly one figure is given."""
        if (self.mass_kg is None) == (self.density_kg_m3 is None):
            raise AssetError("Matter needs a mass or a density, got both or neither; give one.")

    def mass_of(self, volume_m3: float) -> float:
        """Return the mass in kg of an object of this volume."""
        if self.density_kg_m3 is not None:
            return self.density_kg_m3 * volume_m3
        assert self.mass_kg is not None
        return self.mass_kg


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """What a family's builder returns: geometry without name, words or weight.

    Attributes:
        solids: Closed bodies; they may overlap. z points up in the natural rest pose.
        collision: Convex parts that cover them.
        rolls: The object rolls, so it needs rolling friction to come to rest.
        gloss: Specular reflectance in 0..1.
    """

    solids: Sequence[Solid]
    collision: Sequence[CollisionPart]
    rolls: bool = False
    gloss: float = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class ObjectAsset:
    """An object ready for simulation.

    The frame's origin lies on the lowest point of the mesh, under the centre of its bounding
    box; z points up as the object naturally rests.

    Attributes:
        name: Name in the catalogue.
        family: Name of the function that shaped it.
        split: "seen", "unseen", or "sampled" for a variant drawn at random.
        words: How people ask for it.
        vertices: (V, 3) float64, metres.
        faces: (F, 3) int32, counter-clockwise seen from outside.
        uv: (V, 2) float64 texture coordinates, OBJ convention (v up).
        texture: (H, W, 3) uint8, row 0 at v = 1.
        collision: Convex parts.
        mass_kg: Mass.
        center_of_mass: (3,) float64, metres.
        inertia: (3, 3) float64 about the centre of mass along the frame's axes, kg m^2.
        density_kg_m3: Mass over the volume of the union of the solids.
        matter_source: Where mass or density come from.
        rolls: See `Shape`.
        gloss: See `Shape`.
    """

    name: str
    family: str
    split: str
    words: ObjectWords
    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    texture: np.ndarray
    collision: tuple[CollisionPart, ...]
    mass_kg: float
    center_of_mass: np.ndarray
    inertia: np.ndarray
    density_kg_m3: float
    matter_source: str
    rolls: bool
    gloss: float

    def __post_init__(self) -> None:
        """Check shapes and values once, and make the arrays read-only."""
        expected = {
            "vertices": ((None, 3), np.float64),
            "faces": ((None, 3), np.int32),
            "uv": ((len(self.vertices), 2), np.float64),
            "texture": ((None, None, 3), np.uint8),
            "center_of_mass": ((3,), np.float64),
            "inertia": ((3, 3), np.float64),
        }
        for field, (shape, dtype) in expected.items():
            array = getattr(self, field)
            fits = array.ndim == len(shape) and all(
                want in (None, have) for want, have in zip(shape, array.shape, strict=True)
            )
            if not fits or array.dtype != dtype or not np.all(np.isfinite(array)):
                raise AssetError(
                    f"{field} of object {self.name!r} is {array.dtype} {array.shape}; expected "
                    f"finite {np.dtype(dtype)} {shape}."
                )
            array.setflags(write=False)
        if not self.mass_kg > 0:
            raise AssetError(f"Mass of object {self.name!r} is {self.mass_kg}; it must be > 0.")

    @property
    def size_m(self) -> np.ndarray:
        """Extents (3,) of the mesh along x, y and z in the rest pose, metres."""
        return np.ptp(self.vertices, axis=0)


def closed_mesh(vertices: np.ndarray, faces: np.ndarray) -> trimesh.Trimesh:
    """Join vertices at the same place, which texture seams keep apart."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices(digits_vertex=_DECIMALS + 1)
    return mesh


def _union(solids: Sequence[Solid], name: str) -> trimesh.Trimesh:
    """Unite the solids, so that overlaps are counted once."""
    bodies = []
    for index, solid in enumerate(solids):
        joined = join([panel.surface for panel in solid.panels])
        body = closed_mesh(joined.vertices, joined.faces)
        if not body.is_watertight or body.volume <= 0:
            raise AssetError(
                f"Solid {index} of object {name!r} is not closed with its faces outwards; "
                "check the order of its rings."
            )
        bodies.append(body)
    return bodies[0] if len(bodies) == 1 else trimesh.boolean.union(bodies, engine="manifold")


def _significant(values: np.ndarray | float) -> np.ndarray:
    """Round to six significant digits of the largest value."""
    values = np.asarray(values, float)
    scale = 10.0 ** (_SIGNIFICANT - 1 - np.floor(np.log10(np.abs(values).max())))
    return np.rint(values * scale) / scale


def assemble(
    shape: Shape, *, name: str, family: str, split: str, words: ObjectWords, matter: Matter
) -> ObjectAsset:
    """Turn a shape into an asset: atlas, base-centred frame, mass and inertia.

    Args:
        shape: Geometry from a family.
        name: Name in the catalogue.
        family: Name of the family.
        split: "seen" or "unseen".
        words: How people ask for it.
        matter: Mass or density.

    Returns:
        The asset.

    Raises:
        AssetError: If a solid is not closed or the images do not fit the texture.
    """
    panels: list[Panel] = [panel for solid in shape.solids for panel in solid.panels]
    surface, texture = join_panels(panels)
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    base = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])

    union = _union(shape.solids, name)
    volume = float(union.volume)
    mass = float(_significant(matter.mass_of(volume)))
    inertia = _significant(np.asarray(union.moment_inertia) * (mass / volume))
    return ObjectAsset(
        name=name,
        family=family,
        split=split,
        words=words,
        vertices=np.round(surface.vertices - base, _DECIMALS) + 0.0,
        faces=surface.faces.astype(np.int32),
        uv=np.round(surface.uv, _UV_DECIMALS),
        texture=texture,
        collision=tuple(part.moved(-base) for part in shape.collision),
        mass_kg=mass,
        center_of_mass=np.round(np.asarray(union.center_mass) - base, _DECIMALS + 1) + 0.0,
        inertia=(inertia + inertia.T) / 2,
        density_kg_m3=float(_significant(mass / volume)),
        matter_source=matter.source,
        rolls=shape.rolls,
        gloss=shape.gloss,
    )
