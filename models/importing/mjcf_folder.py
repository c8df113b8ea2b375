"""Other people's MJCF objects, as robosuite, LIBERO and obj2mjcf write them.

The document is compiled by MuJoCo, so that defaults, units and file formats mean what its author
meant, and written anew as one body without joints. Visual and collision geoms are kept: geoms
without contact bits are seen, the others are felt, and only these weigh. Contact settings that the
author chose are kept; rolling friction is added, so that scenes come to rest.
"""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import trimesh

from models.errors import ImportRefusedError
from models.importing.mjcf_document import Document, is_mjcf, read_document
from models.importing.mjcf_surface import geom_surface, mesh_surface
from models.importing.mjcf_writer import write_object
from models.importing.scan import MAX_SIZE_M, MIN_SIZE_M
from models.objects.mjcf_object import MjcfObject
from models.objects.words import ObjectWords

__all__ = ["is_mjcf", "read_mjcf_object"]

_SOLID_TYPES = {
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_MESH,
        mujoco.mjtGeom.mjGEOM_BOX,
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
    )
}
_DECIMALS = 7


@dataclass(frozen=True, kw_only=True, eq=False)
class _Matter:
    """Mass, centre of mass (3,) in the world, inertia (3, 3) about it; SI units."""

    mass_kg: float
    center: np.ndarray
    inertia: np.ndarray
    source: str


def read_mjcf_object(
    path: Path, *, name: str, words: ObjectWords, root: Path, mass_kg: float | None = None
) -> MjcfObject:
    """Read an object from an MJCF document.

    Args:
        path: The document.
        name: Name in the catalogue.
        words: How people ask for it.
        root: Folder that must contain every file it names.
        mass_kg: Mass in place of the document's own; None keeps that.

    Returns:
        The object; the same files give the same bytes.

    Raises:
        ImportRefusedError: If it cannot be used; the message says why and what to do.
    """
    data = _compile(read_document(path, root), path)
    visual, collision = _sort_geoms(data.model, path)
    vertices, faces = _surface(data, visual or collision)
    _check_size(vertices, path)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    base = np.array([*(low + high)[:2] / 2, low[2]])
    matter = _matter(data, vertices, mass_kg, path)
    center = (matter.center - base).round(_DECIMALS) + 0.0
    xml, files = write_object(
        data, visual=visual or collision, collision=collision, base=base, mass_kg=matter.mass_kg,
        center_of_mass=center, inertia=matter.inertia,
    )  # fmt: skip
    return MjcfObject(
        name=name,
        words=words,
        xml=xml,
        assets=files,
        vertices=(vertices - base).round(_DECIMALS) + 0.0,
        faces=faces.astype(np.int32),
        mass_kg=matter.mass_kg,
        center_of_mass=center,
        inertia=matter.inertia,
        matter_source=matter.source,
    )


def _compile(document: Document, path: Path) -> mujoco.MjData:
    """Compile a document without its joints; what is only seen weighs nothing."""
    try:
        spec = mujoco.MjSpec.from_string(document.xml, assets=document.files)
        _check_one_rigid_body(spec, path)
        for joint in list(spec.joints):
            spec.delete(joint)
        model = _compile_weighed(spec)
    except (ValueError, mujoco.FatalError) as error:
        if isinstance(error, ImportRefusedError):
            raise
        reason = " ".join(str(error).split())[:200]
        raise ImportRefusedError(f"MuJoCo refuses {path} ({reason}); fix the document.") from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data


def _check_one_rigid_body(spec: mujoco.MjSpec, path: Path) -> None:
    """Refuse several objects in one document, and joints within an object."""
    bodies = [body for body in spec.worldbody.bodies if body.find_all("geom")]
    if not spec.geoms:
        raise ImportRefusedError(f"{path} has no geoms; an object needs at least one.")
    if len(bodies) > 1:
        raise ImportRefusedError(
            f"{path} has {len(bodies)} bodies in its world, expected one; make a document an "
            "object."
        )
    if not bodies or len(bodies[0].find_all("geom")) < len(spec.geoms):
        raise ImportRefusedError(
            f"{path} has geoms outside a body; put the object's into one body and remove others."
        )
    free = mujoco.mjtJoint.mjJNT_FREE
    moving = [joint for joint in spec.joints if joint.type != free]
    if moving:
        raise ImportRefusedError(
            f"{path} has {len(moving)} joints that are not free; only rigid objects are imported."
        )


def _compile_weighed(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile so that what is only seen weighs nothing, as in robosuite; else all counts twice."""
    felt = {geom.meshname for geom in spec.geoms if geom.contype or geom.conaffinity}
    for geom in spec.geoms:
        if not (geom.contype or geom.conaffinity):
            geom.mass = 0
    for mesh in spec.meshes:
        if mesh.name not in felt:
            # A scan with holes has no volume, and needs none to be seen.
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    meshes = [mesh for mesh in spec.meshes if mesh.name in felt]
    try:
        model = spec.compile()
        unclosed = [mesh for mesh in meshes if not _is_closed(model, model.mesh(mesh.name).id)]
    except ValueError:
        unclosed = meshes
    for mesh in unclosed:
        # It collides as its convex hull, so it may as well weigh as much.
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    return spec.compile()


def _is_closed(model: mujoco.MjModel, mesh: int) -> bool:
    solid = trimesh.Trimesh(*mesh_surface(model, mesh), process=False)
    solid.merge_vertices(digits_vertex=_DECIMALS)
    return bool(solid.is_watertight)


def _sort_geoms(model: mujoco.MjModel, path: Path) -> tuple[list[int], list[int]]:
    """Return the geoms that are seen and those that are felt; repeated ones are left out."""
    for geom in range(model.ngeom):
        if int(model.geom_type[geom]) not in _SOLID_TYPES:
            kind = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            raise ImportRefusedError(f"{path} has a geom of type {kind!r}; expected solids.")
    felt = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    if not felt.any():
        raise ImportRefusedError(
            f"{path} has no collision geoms, only visual ones; import its mesh instead, which is "
            "then decomposed."
        )
    visual = _distinct(model, np.flatnonzero(~felt).tolist())
    return visual, np.flatnonzero(felt).tolist()


def _distinct(model: mujoco.MjModel, geoms: list[int]) -> list[int]:
    """Drop copies at the same place (robosuite repeats visual geoms in two groups)."""
    fields = ("type", "dataid", "matid", "bodyid", "size", "pos", "quat", "rgba")
    keys = [tuple(np.ravel(getattr(model, f"geom_{f}")[g]).tolist() for f in fields) for g in geoms]
    firsts = {str(key): geom for key, geom in zip(reversed(keys), reversed(geoms), strict=True)}
    return sorted(firsts.values())


def _surface(data: mujoco.MjData, geoms: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Join the triangles of geoms in the world's frame."""
    vertices, faces, count = [], [], 0
    for geom in geoms:
        points, triangles = geom_surface(data.model, geom)
        vertices.append(points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
        faces.append(triangles + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def _check_size(vertices: np.ndarray, path: Path) -> None:
    size = float(np.ptp(vertices, axis=0).max())
    if not MIN_SIZE_M <= size <= MAX_SIZE_M:
        raise ImportRefusedError(
            f"{path} is {size:.4g} m large, expected {MIN_SIZE_M} to {MAX_SIZE_M} m; if its unit "
            'is another, correct the attribute scale="..." of its meshes.'
        )


def _matter(
    data: mujoco.MjData, vertices: np.ndarray, mass_kg: float | None, path: Path
) -> _Matter:
    """Add up the bodies; a mass given by the user scales the inertia."""
    model = data.model
    total = float(model.body_mass.sum())
    if total <= 0 and mass_kg is None:
        raise ImportRefusedError(
            f"{path} has no mass: neither <inertial> nor collision geoms with a density; give "
            "mass_kg in the words file."
        )
    if total <= 0:
        assert mass_kg is not None
        hull = trimesh.convex.convex_hull(vertices)
        inertia = np.asarray(hull.moment_inertia) * (mass_kg / hull.volume)
        source = "mass from the words file, inertia of the convex hull"
        return _Matter(
            mass_kg=mass_kg, center=np.asarray(hull.center_mass), inertia=inertia, source=source
        )
    center = model.body_mass @ data.xipos / total
    inertia = np.sum([_inertia_about(data, b, center) for b in range(model.nbody)], axis=0)
    mass = total if mass_kg is None else mass_kg
    source = "its MJCF document" if mass_kg is None else "mass from the words file"
    return _Matter(
        mass_kg=float(f"{mass:.6g}"), center=center, inertia=inertia * (mass / total), source=source
    )


def _inertia_about(data: mujoco.MjData, body: int, center: np.ndarray) -> np.ndarray:
    """Return a body's inertia (3, 3) about a point, along the world's axes."""
    axes = data.ximat[body].reshape(3, 3)
    arm = data.xipos[body] - center
    steiner = (arm @ arm) * np.eye(3) - np.outer(arm, arm)
    own = axes @ np.diag(data.model.body_inertia[body]) @ axes.T
    return own + data.model.body_mass[body] * steiner
