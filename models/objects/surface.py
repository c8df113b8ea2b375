"""Closed, UV-mapped surfaces from grids of rings: revolutions, sweeps, lofts, rounded boxes.

UV follows the OBJ convention: (0, 0) is the bottom left corner of the image, v points up.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

# Two corners of a triangle closer than this are one point: the triangle is dropped.
_DEGENERATE_M = 1e-7


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """A triangle mesh with one texture coordinate a vertex.

    Seams of the texture duplicate vertices, so a closed surface is closed by position, not by
    vertex index.

    Attributes:
        vertices: (V, 3) positions, metres.
        faces: (F, 3) vertex indices, counter-clockwise seen from outside.
        uv: (V, 2) texture coordinates in 0..1.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray

    def moved(self, offset: ArrayLike = (0, 0, 0), rotation: Rotation | None = None) -> "Surface":
        """Rotate about the origin, then translate by `offset` metres."""
        vertices = self.vertices if rotation is None else rotation.apply(self.vertices)
        return replace(self, vertices=vertices + np.asarray(offset, float))

    def scaled(self, factors: ArrayLike) -> "Surface":
        """Scale along x, y and z by positive factors."""
        return replace(self, vertices=self.vertices * np.asarray(factors, float))

    def mapped(self, function: Callable[[np.ndarray], np.ndarray]) -> "Surface":
        """Move every vertex by a function of positions, (V, 3) to (V, 3)."""
        return replace(self, vertices=function(self.vertices))

    def planar_uv(self, axes: tuple[int, int] = (0, 1)) -> "Surface":
        """Project texture coordinates along the remaining axis, filling the unit square."""
        plane = self.vertices[:, axes]
        low, high = plane.min(axis=0), plane.max(axis=0)
        return replace(self, uv=(plane - low) / (high - low))


def skin(rings: np.ndarray, *, v: np.ndarray | None = None, loop: bool = False) -> Surface:
    """Stretch a surface over a stack of rings.

    Rings run counter-clockwise about the direction in which the stack grows. A ring whose points
    coincide is a pole; with poles at both ends, or with `loop`, the surface is closed.

    Args:
        rings: (N, M, 3) points, metres.
        v: (N,) texture height of each ring, (N + 1,) with `loop`; by default the mean arc length.
        loop: Join the last ring to the first.

    Returns:
        The surface; u runs once around each ring.
    """
    rings = np.asarray(rings, float)
    if loop:
        rings = np.concatenate([rings, rings[:1]])
    rings = np.concatenate([rings, rings[:, :1]], axis=1)
    num_rings, num_columns = rings.shape[:2]
    if v is None:
        steps = np.linalg.norm(np.diff(rings, axis=0), axis=2).mean(axis=1)
        v = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    u = np.linspace(0.0, 1.0, num_columns)
    uv = np.stack(np.broadcast_arrays(u[None, :], np.asarray(v, float)[:, None]), axis=-1)

    corner = (np.arange(num_rings - 1)[:, None] * num_columns + np.arange(num_columns - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + num_columns + 1], axis=1)
    upper = np.stack([corner, corner + num_columns + 1, corner + num_columns], axis=1)
    faces = np.stack([lower, upper], axis=1).reshape(-1, 3)
    vertices = rings.reshape(-1, 3)
    return _compact(vertices, faces, uv.reshape(-1, 2))


def _compact(vertices: np.ndarray, faces: np.ndarray, uv: np.ndarray) -> Surface:
    """Drop degenerate triangles and the vertices that only they used."""
    corners = vertices[faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    faces = faces[edges.min(axis=1) > _DEGENERATE_M]
    used, compact = np.unique(faces, return_inverse=True)
    return Surface(vertices=vertices[used], faces=compact.reshape(-1, 3), uv=uv[used])


def join(surfaces: Sequence[Surface]) -> Surface:
    """Put several surfaces into one mesh; nothing is welded."""
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = [s.faces + start for s, start in zip(surfaces, starts[:-1], strict=True)]
    return Surface(
        vertices=np.concatenate([surface.vertices for surface in surfaces]),
        faces=np.concatenate(faces),
        uv=np.concatenate([surface.uv for surface in surfaces]),
    )


def circle(num_points: int, exponent: float = 2.0, aspect: float = 1.0) -> np.ndarray:
    """Return (num_points, 2) points of a superellipse with half axes 1 and `aspect`.

    An exponent of 2 gives an ellipse; 4 and more, a rectangle with ever sharper corners.
    """
    angle = np.arange(num_points) * (2 * np.pi / num_points)
    cosine, sine = np.cos(angle), np.sin(angle)
    radius = (np.abs(cosine) ** exponent + np.abs(sine / aspect) ** exponent) ** (-1 / exponent)
    return np.stack([radius * cosine, radius * sine], axis=1)


def revolve(
    profile: ArrayLike,
    *,
    num_columns: int = 40,
    section: np.ndarray | None = None,
    v: np.ndarray | None = None,
    loop: bool = False,
) -> Surface:
    """Turn a profile about the z axis.

    Args:
        profile: (N, 2) radius and height, metres, from the lower pole outwards and up. Going back
            down inside makes a hollow vessel.
        num_columns: Points around the axis.
        section: (M, 2) outline to use in place of the unit circle, for oval or square vessels.
        v: See `skin`.
        loop: The profile is a closed curve that does not touch the axis (a ring).

    Returns:
        The surface; u = 0 lies at +x and grows counter-clockwise seen from above.
    """
    profile = np.asarray(profile, float)
    outline = circle(num_columns) if section is None else section
    rings = np.empty((len(profile), len(outline), 3))
    rings[..., :2] = profile[:, None, :1] * outline[None]
    rings[..., 2] = profile[:, 1:]
    return skin(rings, v=v, loop=loop)


def ellipsoid(half_axes: ArrayLike, *, num_rings: int = 17, num_columns: int = 28) -> Surface:
    """Return an ellipsoid about the origin with the given half axes, metres."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, num_rings)
    profile = np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    profile[[0, -1], 0] = 0.0
    return revolve(profile, num_columns=num_columns).scaled(half_axes)


def sweep(
    path: ArrayLike,
    radii: ArrayLike,
    *,
    num_columns: int = 12,
    section: np.ndarray | None = None,
    up: ArrayLike = (0, 0, 1),
    loop: bool = False,
) -> Surface:
    """Sweep an outline along a path and close both ends.

    Args:
        path: (N, 3) centre line, metres.
        radii: Scale of the outline: one number, (N,), or (N, 2) for sideways and up.
        num_columns: Points of the default circular outline.
        section: (M, 2) outline in (sideways, up) coordinates.
        up: Direction that the outline's second axis follows; must never be along the path.
        loop: Join the end of the path to its start (a ring) instead of closing the ends.

    Returns:
        The swept surface; v runs along the path.
    """
    path = np.asarray(path, float)
    if loop:
        tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    else:
        tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(np.asarray(up, float), tangent)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    normal = np.cross(tangent, side)
    outline = circle(num_columns) if section is None else section
    scale = np.asarray(radii, float)
    scale = np.broadcast_to(scale if scale.ndim == 2 else scale.reshape(-1, 1), (len(path), 2))
    local = outline[None] * scale[:, None]
    rings = path[:, None] + local[..., :1] * side[:, None] + local[..., 1:] * normal[:, None]
    if not loop:
        first = np.broadcast_to(path[0], rings[:1].shape)
        last = np.broadcast_to(path[-1], rings[:1].shape)
        rings = np.concatenate([first, rings, last])
    return skin(rings, loop=loop)


def plate(
    outline: np.ndarray, thickness_m: float, *, bevel_m: float = 0.0, base_m: float = 0.0
) -> Surface:
    """Give thickness to a flat outline that is star-shaped about its vertices' mean.

    Args:
        outline: (M, 2) polygon in the xy plane, counter-clockwise, metres.
        thickness_m: Extent along z.
        bevel_m: Width and height of the bevel along the rim.
        base_m: Height of the lower face.

    Returns:
        The plate, texture projected along z.
    """
    outline = np.asarray(outline, float)
    center = outline.mean(axis=0)
    reach = np.linalg.norm(outline - center, axis=1, keepdims=True)
    inner = center + (outline - center) * np.maximum(1 - bevel_m / reach, 0.3)
    pole = np.broadcast_to(center, outline.shape)
    top = base_m + thickness_m
    layers = [(pole, base_m), (inner, base_m), (outline, base_m + bevel_m)]
    layers += [(outline, top - bevel_m), (inner, top), (pole, top)]
    rings = np.stack([np.column_stack([xy, np.full(len(xy), z)]) for xy, z in layers])
    return skin(rings).planar_uv()


def refined(outline: np.ndarray, step_m: float) -> np.ndarray:
    """Insert points into the edges of a polygon, so that a fan over it has no slivers.

    Args:
        outline: (M, 2) polygon, metres.
        step_m: Spacing of the points, about.

    Returns:
        (N, 2) the same polygon with more points.
    """
    points = []
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        num = max(1, int(np.linalg.norm(end - start) / step_m))
        points += [start + (end - start) * k / num for k in range(num)]
    return np.array(points)


def disc(ring: np.ndarray, *, faces_up: bool) -> Surface:
    """Fill a flat ring of (M, 3) points, counter-clockwise seen from above, with a fan.

    The texture is projected along z: it fills the ring's bounding square.
    """
    pole = np.broadcast_to(ring.mean(axis=0), ring.shape)
    rings = np.stack([ring, pole] if faces_up else [pole, ring])
    return skin(rings).planar_uv()


def rounded_box(size: ArrayLike, radius_m: float, *, num_round: int = 4) -> list[Surface]:
    """Build the six sides of a box with rounded edges, centred on the origin.

    Args:
        size: Extents along x, y and z, metres.
        radius_m: Radius of the edges, below half the smallest extent.
        num_round: Segments across half of an edge's quarter circle.

    Returns:
        Sides in the order +x, -x, +y, -y, +z, -z, together closed. The texture of each fills the
        unit square, upright seen from outside; top and bottom are upright seen from -y.
    """
    half = np.asarray(size, float) / 2
    # Columns: normal, right and up of each side as seen from outside.
    frames = [
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
        ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
        ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
    ]
    return [_rounded_side(half, radius_m, num_round, np.array(axes, float)) for axes in frames]


def _rounded_side(half: np.ndarray, radius: float, num_round: int, axes: np.ndarray) -> Surface:
    """Build the side of a rounded box whose normal, right and up are the rows of `axes`."""
    reach = np.abs(axes) @ half
    bend = radius * np.tan(np.linspace(np.pi / 4, 0, num_round + 1))
    grids = []
    for extent in reach[1:]:
        flat = extent - radius
        rise = flat + bend
        # A middle line keeps the triangles of large faces from growing into slivers.
        grids.append(np.concatenate([-rise, [0.0], rise[::-1]]))
    right, up = np.meshgrid(*grids, indexing="xy")
    cube = reach[0] * axes[0] + right[..., None] * axes[1] + up[..., None] * axes[2]
    core = np.clip(cube, -(half - radius), half - radius)
    offset = cube - core
    points = core + radius * offset / np.linalg.norm(offset, axis=-1, keepdims=True)
    rows, columns = right.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    upper = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    flat = points.reshape(-1, 3)
    uv = np.stack([flat @ axes[1] / reach[1], flat @ axes[2] / reach[2]], axis=1) / 2 + 0.5
    return Surface(vertices=flat, faces=np.concatenate([lower, upper]), uv=uv)
