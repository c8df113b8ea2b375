"""Collision parts: primitives where they fit, small convex polyhedra elsewhere."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from models.errors import AssetError

PartKind = Literal["box", "cylinder", "sphere", "ellipsoid", "capsule", "convex"]
MAX_VERTICES = 32
_NUM_SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "ellipsoid": 3, "capsule": 2, "convex": 0}


@dataclass(frozen=True, kw_only=True, eq=False)
class CollisionPart:
    """One convex part of an object's collision geometry, in the object's frame.

    Attributes:
        kind: MuJoCo's name of the primitive, or "convex" for the hull of `vertices`.
        size: MuJoCo's size parameters of the primitive (half extents, radius, half length), metres.
        position: Centre, metres.
        quat_wxyz: Orientation.
        vertices: (N, 3) corners of a convex part relative to `position`, else (0, 3); N <= 32.
    """

    kind: PartKind
    size: tuple[float, ...] = ()
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quat_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    vertices: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        """Check the number of sizes and vertices."""
        if len(self.size) != _NUM_SIZES[self.kind] or min(self.size, default=1.0) <= 0:
            raise AssetError(
                f"A {self.kind} part has sizes {self.size}; expected {_NUM_SIZES[self.kind]} "
                "positive numbers."
            )
        num = len(self.vertices)
        if (self.kind == "convex") != (4 <= num <= MAX_VERTICES) or (
            self.kind != "convex" and num > 0
        ):
            raise AssetError(
                f"A {self.kind} part has {num} vertices; convex parts have 4 to {MAX_VERTICES}, "
                "primitives none."
            )
        self.vertices.setflags(write=False)

    def moved(
        self, offset: ArrayLike = (0, 0, 0), rotation: Rotation | None = None
    ) -> "CollisionPart":
        """Rotate about the origin of the object's frame, then translate by `offset` metres."""
        turn = Rotation.identity() if rotation is None else rotation
        position = turn.apply(self.position) + np.asarray(offset, float)
        own = Rotation.from_quat(self.quat_wxyz, scalar_first=True)
        quat = (turn * own).as_quat(scalar_first=True)
        return replace(self, position=_numbers(position), quat_wxyz=_numbers(quat))


def _numbers(values: ArrayLike) -> tuple:
    """Convert to a tuple of floats rounded to a nanometre, free of negative zeros."""
    return tuple(float(round(float(value), 9)) + 0.0 for value in np.ravel(values))


def box(size: ArrayLike, center: ArrayLike = (0, 0, 0)) -> CollisionPart:
    """Return a box with full extents `size` about `center`, metres."""
    half = _numbers(np.asarray(size, float) / 2)
    return CollisionPart(kind="box", size=half, position=_numbers(center))


def cylinder(radius: float, low: float, high: float) -> CollisionPart:
    """Return an upright cylinder on the z axis between two heights, metres."""
    size = _numbers([radius, (high - low) / 2])
    return CollisionPart(kind="cylinder", size=size, position=_numbers([0, 0, (low + high) / 2]))


def sphere(radius: float, center: ArrayLike = (0, 0, 0)) -> CollisionPart:
    """Return a sphere, metres."""
    return CollisionPart(kind="sphere", size=_numbers([radius]), position=_numbers(center))


def ellipsoid(half_axes: ArrayLike, center: ArrayLike = (0, 0, 0)) -> CollisionPart:
    """Return an ellipsoid along the object's axes, metres."""
    return CollisionPart(kind="ellipsoid", size=_numbers(half_axes), position=_numbers(center))


def _between(start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, Rotation, float]:
    """Return the centre, the rotation of +z onto the segment, and half the segment's length."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    azimuth = np.arctan2(axis[1], axis[0])
    polar = np.arctan2(np.hypot(axis[0], axis[1]), axis[2])
    return (start + end) / 2, Rotation.from_euler("ZY", [azimuth, polar]), length / 2


def capsule(radius: float, start: ArrayLike, end: ArrayLike) -> CollisionPart:
    """Return a capsule whose axis runs from `start` to `end`, metres."""
    center, rotation, half = _between(np.asarray(start, float), np.asarray(end, float))
    part = CollisionPart(kind="capsule", size=_numbers([radius, half]))
    return part.moved(center, rotation)


def rod(radius: float, start: ArrayLike, end: ArrayLike) -> CollisionPart:
    """Return a cylinder whose axis runs from `start` to `end`, metres."""
    center, rotation, half = _between(np.asarray(start, float), np.asarray(end, float))
    part = CollisionPart(kind="cylinder", size=_numbers([radius, half]))
    return part.moved(center, rotation)


def capsule_chain(radius: ArrayLike, path: np.ndarray) -> list[CollisionPart]:
    """Return capsules along the (N, 3) path; `radius` is one number or one a segment, metres."""
    radii = np.broadcast_to(radius, len(path) - 1)
    ends = zip(radii, path[:-1], path[1:], strict=True)
    return [capsule(float(r), start, end) for r, start, end in ends]


def convex(points: np.ndarray) -> CollisionPart:
    """Return the convex hull of (N, 3) points, metres."""
    points = np.asarray(points, float)
    center = np.round(points.mean(axis=0), 6)
    return CollisionPart(
        kind="convex", position=_numbers(center), vertices=np.round(points - center, 6)
    )


def prism(outline: np.ndarray, low: float, high: float) -> CollisionPart:
    """Return the upright prism over a convex (N, 2) outline between two heights, metres."""
    layers = [np.column_stack([outline, np.full(len(outline), z)]) for z in (low, high)]
    return convex(np.concatenate(layers))


def _round_section(num_sectors: int) -> np.ndarray:
    """Return a polygon that runs half inside, half outside the unit circle."""
    angle = np.arange(num_sectors) * (2 * np.pi / num_sectors)
    grow = 2 / (1 + np.cos(np.pi / num_sectors))
    return grow * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def vessel(
    outer: ArrayLike,
    inner: ArrayLike,
    *,
    num_sectors: int = 12,
    section: np.ndarray | None = None,
) -> list[CollisionPart]:
    """Cover the wall of an open vessel with convex wedges and its floor with a thin prism.

    Args:
        outer: (N, 2) radius and height of the outside from the foot to the rim, metres.
        inner: (N, 2) the same for the inside, from the top of the floor to the rim.
        num_sectors: Wedges around the axis, at most 16.
        section: Unit outline for oval or square vessels, (M, 2) with M <= 16; a wedge a side.

    Returns:
        N - 1 wedges a sector, and the floor.
    """
    outside, inside = np.asarray(outer, float), np.asarray(inner, float)
    ring = _round_section(num_sectors) if section is None else section
    parts = []
    for level in range(len(outside) - 1):
        profile = [outside[level], outside[level + 1], inside[level + 1], inside[level]]
        for sector in range(len(ring)):
            edges = ring[[sector, (sector + 1) % len(ring)]]
            corners = [(*(r * edge), z) for r, z in profile for edge in edges]
            parts.append(convex(np.array(corners)))
    foot, floor = outside[0], inside[0]
    parts.append(prism(floor[0] * ring, foot[1], floor[1]))
    return parts
