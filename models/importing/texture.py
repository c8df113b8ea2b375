"""Carries a scan's colours over to the texture of its decimated mesh."""

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree

from models.importing.charts import Layout
from models.importing.scan import Piece, Scan

_NUM_SAMPLES = 600_000
_NUM_NEAREST = 4
# The two sides of a thin sheet are told apart by their normals: opposite ones count as this
# fraction of the object's size apart.
_NORMAL_WEIGHT = 0.01


def bake(scan: Scan, layout: Layout) -> np.ndarray:
    """Paint the texture of a layout with the colours of the scan it was made from.

    Args:
        scan: The original.
        layout: The decimated mesh.

    Returns:
        (H, W, 3) uint8, row 0 at v = 1; what no face covers repeats the nearest colour.
    """
    points, normals, colors = _sample(scan)
    weight = _NORMAL_WEIGHT * float(np.ptp(points, axis=0).max())
    tree = KDTree(np.concatenate([points, weight * normals], axis=1))
    texels, places, facing = _covered_texels(layout)
    nearest = tree.query(np.concatenate([places, weight * facing], axis=1), k=_NUM_NEAREST)[1]
    texture = np.zeros((*layout.size_px, 3), np.uint8)
    texture[texels[:, 0], texels[:, 1]] = np.rint(255 * colors[nearest].mean(axis=1))
    covered = np.zeros(layout.size_px, bool)
    covered[texels[:, 0], texels[:, 1]] = True
    nearest_covered = distance_transform_edt(~covered, return_distances=False, return_indices=True)
    rows, columns = np.asarray(nearest_covered)
    return texture[rows, columns]


def _sample(scan: Scan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Spread points over the scan by area; return points, normals, colours, all (N, 3)."""
    parts = [_sample_piece(piece, _area(scan)) for piece in scan.pieces]
    points, normals, colors = zip(*parts, strict=True)
    return np.concatenate(points), np.concatenate(normals), np.concatenate(colors)


def _cross(piece: Piece) -> np.ndarray:
    corners = piece.vertices[piece.faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _area(scan: Scan) -> float:
    return sum(float(np.linalg.norm(_cross(piece), axis=1).sum()) / 2 for piece in scan.pieces)


def _sample_piece(piece: Piece, total_area: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample one piece; every face gets at least its middle."""
    cross = _cross(piece)
    norm = np.linalg.norm(cross, axis=1)
    count = 1 + np.floor(_NUM_SAMPLES * norm / 2 / total_area).astype(int)
    face = np.repeat(np.arange(len(count)), count)
    # A fixed seed: the same scan gives the same texture.
    draws = np.random.default_rng(0).random((len(face), 2))
    root = np.sqrt(draws[:, 0])
    weights = np.stack([1 - root, root * (1 - draws[:, 1]), root * draws[:, 1]], axis=1)
    weights[np.cumsum(count) - 1] = 1 / 3
    points = np.einsum("nk,nkc->nc", weights, piece.vertices[piece.faces[face]])
    normals = (cross / np.maximum(norm, 1e-30)[:, None])[face]
    return points, normals, piece.colors_at(face, weights)


def _covered_texels(layout: Layout) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (T, 2) row and column of the texels under faces, their points, and normals."""
    corners = layout.vertices[layout.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    # Corners first, so that charts smaller than a texel get a colour too.
    texels = [layout.pixels[layout.faces.ravel()].astype(int)[:, ::-1]]
    places, facing = [corners.reshape(-1, 3)], [np.repeat(normals, 3, axis=0)]
    for index, triangle in enumerate(layout.pixels[layout.faces]):
        inside, weights = _rasterize(triangle)
        texels.append(inside)
        places.append(weights @ corners[index])
        facing.append(np.broadcast_to(normals[index], (len(inside), 3)))
    return np.concatenate(texels), np.concatenate(places), np.concatenate(facing)


def _rasterize(triangle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the (T, 2) texels whose centres lie in a (3, 2) triangle, and their weights."""
    low, high = (f(axis=0).astype(int) for f in (triangle.min, triangle.max))
    columns, rows = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)))
    texels = np.stack([rows.ravel(), columns.ravel()], axis=1)
    edges = triangle[1:] - triangle[0]
    area = edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0]
    if abs(area) < 1e-9:
        return texels[:0], np.zeros((0, 3))
    offset = texels[:, ::-1] + 0.5 - triangle[0]
    second = (offset[:, 0] * edges[1, 1] - offset[:, 1] * edges[1, 0]) / area
    third = (edges[0, 0] * offset[:, 1] - edges[0, 1] * offset[:, 0]) / area
    weights = np.stack([1 - second - third, second, third], axis=1)
    inside = weights.min(axis=1) >= -1e-9
    return texels[inside], weights[inside]
