"""Where an object may be put, and whether it was put there, by the evaluation protocol's rules.

Ground truth: for evaluation, experts and the making of arrangements only.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from perception.relations import INSIDE_RELATIONS, OUTSIDE_RELATIONS
from sr_mj.errors import UnknownNameError, unknown_name_message
from sr_mj.scene.build import Scene, SceneObject

RING_M = (0.05, 0.15)
"""Smallest and largest distance from the reference's edge for relations such as "near"."""

_CORE_SHARE = 1 / 3
_CLOSE_M = 1e-4
_WORLD = 0  # the body that the table belongs to
# Least vertical part of a contact's normal at which one thing lies on the other; less leans.
_LIES_ON = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaceRegion:
    """Where the centre of a placed object may lie, seen from above.

    Attributes:
        relation: One of `perception.relations.RELATIONS`.
        reference: Name of the object that the region belongs to.
        is_inside: Whether the object has to rest on or in the reference; otherwise beside it.
        area: Polygons in world x, y, metres; empty if there is no such place.
    """

    relation: str
    reference: str
    is_inside: bool
    area: BaseGeometry

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which points (..., 2) or (..., 3), metres, lie in the region; (...) bool."""
        points = np.asarray(points, float)
        return shapely.intersects_xy(self.area, points[..., 0], points[..., 1])

    def sample(self, rng: np.random.Generator, num: int) -> np.ndarray:
        """Draw points uniformly from the region.

        Args:
            rng: Source of randomness.
            num: How many.

        Returns:
            (num, 2) metres; (0, 2) if the region is empty.
        """
        if self.area.is_empty:
            return np.zeros((0, 2))
        x0, y0, x1, y1 = self.area.bounds
        found = np.zeros((0, 2))
        while len(found) < num:
            draws = rng.uniform((x0, y0), (x1, y1), (16 * num, 2))
            found = np.concatenate([found, draws[self.contains(draws)]])
        return found[:num]


def footprint(scene: Scene, name: str) -> BaseGeometry:
    """Return the convex outline of an object, seen from above, as it lies now.

    Args:
        scene: The scene.
        name: One of its objects.

    Returns:
        Polygon in world x, y, metres.
    """
    vertices = find_object(scene, name).asset.vertices
    pose = scene.T_world_object(name)
    points = vertices @ pose[:3, :3].T + pose[:3, 3]
    return shapely.MultiPoint(points[:, :2]).convex_hull


def find_object(scene: Scene, name: str) -> SceneObject:
    """Return an object of a scene by its name.

    Raises:
        UnknownNameError: If the scene has no such object.
    """
    for item in scene.objects:
        if item.name == name:
            return item
    names = [item.name for item in scene.objects]
    raise UnknownNameError(unknown_name_message("object", name, names))


def place_region(
    scene: Scene, relation: str, reference: str, *, moved: str | None = None, clearance_m: float = 0
) -> PlaceRegion:
    """Return where an object may be put in relation to another.

    Inside relations: the reference's footprint shrunk about its centre until its smaller side is a
    third of what it was. Outside relations: 0.05 to 0.15 m from the reference's edge, in the
    workspace, free of every other object's footprint.

    Args:
        scene: The scene, as it is now.
        relation: One of `perception.relations.RELATIONS`.
        reference: Name of the object to place by.
        moved: Name of the object that is placed, which stands in nobody's way.
        clearance_m: Distance to keep from every object and from the workspace's edge, for outside
            relations: 0 for the rule, the object's own radius for planning.

    Returns:
        The region.

    Raises:
        UnknownNameError: If relation or reference do not exist.
    """
    outline = footprint(scene, reference)
    if relation in INSIDE_RELATIONS:
        area, is_inside = _core(outline), True
    elif relation in OUTSIDE_RELATIONS:
        others = [o.name for o in scene.objects if o.name not in (reference, moved)]
        area, is_inside = _ring(scene, outline, others, clearance_m), False
    else:
        known = (*INSIDE_RELATIONS, *OUTSIDE_RELATIONS)
        raise UnknownNameError(unknown_name_message("relation", relation, known))
    return PlaceRegion(relation=relation, reference=reference, is_inside=is_inside, area=area)


def _core(outline: BaseGeometry) -> BaseGeometry:
    """Shrink an outline by the same distance everywhere, to a third of its smaller side."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    smaller_side = np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min()
    return outline.buffer(-smaller_side * (1 - _CORE_SHARE) / 2)


def _ring(
    scene: Scene, outline: BaseGeometry, others: list[str], clearance_m: float
) -> BaseGeometry:
    near, far = RING_M
    ring = outline.buffer(far).difference(outline.buffer(max(near, clearance_m)))
    blocked = shapely.union_all([footprint(scene, name).buffer(clearance_m) for name in others])
    lower, upper = scene.workspace.lower, scene.workspace.upper
    table = shapely.box(lower[0], lower[1], upper[0], upper[1]).buffer(-clearance_m)
    return ring.intersection(table).difference(blocked)


def is_placed(scene: Scene, moved: str, region: PlaceRegion) -> bool:
    """Tell whether an object that was put down and has settled satisfies the relation.

    Inside: it touches the reference and neither the table nor anything else that lies on it, and
    its centre is over the reference's footprint. Outside: its centre lies in the ring around the
    reference as that lies now, and it touches the table and no other object.

    Args:
        scene: The scene, settled.
        moved: Name of the object.
        region: Where it was to go.

    Returns:
        Whether it is there.
    """
    touched = touched_bodies(scene, moved)
    center = scene.data.xipos[find_object(scene, moved).body.body_id]
    outline = footprint(scene, region.reference)
    reference = find_object(scene, region.reference).body.body_id
    if region.is_inside:
        over = bool(shapely.intersects_xy(outline, center[0], center[1]))
        return over and touched == {reference}
    objects = {item.body.body_id for item in scene.objects}
    distance = shapely.distance(outline, shapely.Point(center[:2]))
    is_free = _WORLD in touched and not touched & objects
    return RING_M[0] <= distance <= RING_M[1] and is_free


def touched_bodies(scene: Scene, name: str) -> set[int]:
    """Return the ids of the bodies that an object touches; 0 is the world.

    Args:
        scene: The scene.
        name: One of its objects.

    Returns:
        Body ids.
    """
    return {int(other) for other in _contacts(scene, name)[0]}


def objects_on(scene: Scene, name: str) -> tuple[str, ...]:
    """Name the objects that lie on another, which would come along if that were lifted.

    Args:
        scene: The scene.
        name: One of its objects.

    Returns:
        Names of those that touch it from above.
    """
    bodies, upward = _contacts(scene, name)
    above = {int(body) for body in bodies[upward > _LIES_ON]}
    return tuple(item.name for item in scene.objects if item.body.body_id in above)


def _contacts(scene: Scene, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return what touches an object, by body (C,), and how far up (C,) it is touched, -1 to 1."""
    body = find_object(scene, name).body.body_id
    data = _everything_awake(scene)
    contact, num = data.contact, data.ncon
    pairs = scene.model.geom_bodyid[contact.geom[:num]]
    mine = (contact.dist[:num] < _CLOSE_M) & np.any(pairs == body, axis=1)
    is_first = pairs[mine, 0] == body
    # The normal points from the first of a pair to the second.
    upward = np.where(is_first, 1, -1) * contact.frame[:num][mine, 2]
    return np.where(is_first, pairs[mine, 1], pairs[mine, 0]), upward


def _everything_awake(scene: Scene) -> mujoco.MjData:
    """Return a copy of the state with all contacts; MuJoCo drops those between sleeping bodies."""
    data, flags = mujoco.MjData(scene.model), scene.model.opt.enableflags
    data.qpos[:] = scene.data.qpos
    scene.model.opt.enableflags = flags & ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    mujoco.mj_forward(scene.model, data)
    scene.model.opt.enableflags = flags
    return data
