"""Cuts a mesh into charts along six directions and lays them out in one square texture.

A decimated scan cannot keep its texture coordinates, so it gets new ones: each chart is the piece
of surface that faces one axis, projected along it. Charts are few and large, which matters more to
a renderer's mipmaps than how evenly they use the picture.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

_AXES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
_GUTTER_PX = 3
_SMOOTHING_ROUNDS = 6
# A face joins its neighbours' chart unless it is seen there at more than 78 degrees.
_LEAST_COSINE = 0.2
_BISECTIONS = 24


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """A mesh with texture coordinates of its own.

    Attributes:
        vertices: (V, 3) metres; vertices on the border of charts are repeated.
        faces: (F, 3) in the order of the faces that were laid out.
        pixels: (V, 2) place in the texture: column and row from the top left corner, pixels.
        size_px: (rows, columns) of the texture.
    """

    vertices: np.ndarray
    faces: np.ndarray
    pixels: np.ndarray
    size_px: tuple[int, int]

    @property
    def uv(self) -> np.ndarray:
        """Texture coordinates (V, 2), v up."""
        rows, columns = self.size_px
        return np.stack([self.pixels[:, 0] / columns, 1 - self.pixels[:, 1] / rows], axis=1)


def lay_out(mesh: trimesh.Trimesh, largest_px: int) -> Layout:
    """Give a mesh texture coordinates.

    Args:
        mesh: The mesh, welded.
        largest_px: Width of the texture; its height is at most as much.

    Returns:
        The layout; every chart has a gutter of three pixels.
    """
    direction, chart = _charts(mesh)
    faces = np.asarray(mesh.faces)
    keys, inverse = np.unique(
        np.stack([np.repeat(chart, 3), faces.ravel()], axis=1), axis=0, return_inverse=True
    )
    of_chart = np.zeros(chart.max() + 1, int)
    of_chart[chart] = direction
    vertices = np.asarray(mesh.vertices, float)[keys[:, 1]]
    flat = _project(vertices, of_chart[keys[:, 0]])
    low, size = _boxes(flat, keys[:, 0])
    corners, density, rows = _pack(size, largest_px)
    pixels = corners[keys[:, 0]] + _GUTTER_PX + (flat - low[keys[:, 0]]) * density
    return Layout(
        vertices=vertices,
        faces=inverse.reshape(-1, 3),
        pixels=pixels,
        size_px=(rows, largest_px),
    )


def _charts(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Return for each face the index of its direction and the number of its chart."""
    cosines = np.asarray(mesh.face_normals) @ _AXES.T
    direction = cosines.argmax(axis=1)
    pairs = np.asarray(mesh.face_adjacency).reshape(-1, 2)
    for _ in range(_SMOOTHING_ROUNDS):
        votes = np.zeros_like(cosines)
        for one, other in (pairs.T, pairs.T[::-1]):
            np.add.at(votes, (one, direction[other]), 1.0)
        # One's own direction breaks ties, and foreshortening forbids.
        votes[np.arange(len(votes)), direction] += 0.5
        votes[cosines < _LEAST_COSINE] = -1
        votes[np.arange(len(votes)), cosines.argmax(axis=1)] += 0.1
        direction = votes.argmax(axis=1)
    joined = pairs[direction[pairs[:, 0]] == direction[pairs[:, 1]]]
    graph = coo_matrix((np.ones(len(joined)), joined.T), shape=(len(cosines),) * 2)
    return direction, connected_components(graph, directed=False)[1]


def _project(vertices: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Drop the coordinate along each vertex's direction; (V, 3) -> (V, 2)."""
    kept = np.array([(1, 2), (0, 2), (0, 1)])[direction // 2]
    return np.take_along_axis(vertices, kept, axis=1)


def _boxes(flat: np.ndarray, chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lower corner and size of each chart's bounding box, (C, 2) both."""
    count = int(chart.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart, flat)
    np.maximum.at(high, chart, flat)
    return low, high - low


def _pack(size: np.ndarray, width: int) -> tuple[np.ndarray, float, int]:
    """Find the largest density, pixels a metre, at which all boxes fit a square."""
    low, high = 0.0, 2 * width / max(float(size.max()), 1e-9)
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        fits = _shelve(size, middle, width)[1] <= width
        low, high = (middle, high) if fits else (low, middle)
    corners, rows = _shelve(size, low, width)
    return corners, low, rows


def _shelve(size: np.ndarray, density: float, width: int) -> tuple[np.ndarray, int]:
    """Place boxes on shelves, tallest first; return corners (C, 2) and the height used."""
    boxes = np.ceil(size * density).astype(int) + 2 * _GUTTER_PX + 1
    if boxes[:, 0].max() > width:
        return np.zeros_like(boxes), width + 1
    corners = np.zeros_like(boxes)
    column = row = shelf = 0
    for index in np.lexsort((-boxes[:, 0], -boxes[:, 1])):
        if column + boxes[index, 0] > width:
            column, row, shelf = 0, row + shelf, 0
        corners[index] = (column, row)
        column += boxes[index, 0]
        shelf = max(shelf, boxes[index, 1])
    return corners, int(row + shelf)
