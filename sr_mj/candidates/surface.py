"""What the sampler needs of a fused cloud: thinned object points, unseen walls, seeds."""

from dataclasses import dataclass

import numpy as np

from sr_mj.candidates.config import AntipodalConfig

# A square of 30 mm with fewer points holds specks of noise over the table; a coin holds 30.
_SUPPORT_CELL_M, _MIN_SUPPORT = 0.01, 10


@dataclass(frozen=True, kw_only=True)
class ObjectSurface:
    """Surface points of everything that stands on the table.

    Attributes:
        points: (N, 3) float32 world positions, metres, one a voxel.
        normals: (N, 3) float32 unit normals, towards the cameras.
        colors: (N, 3) float32 RGB, 0..1; black if none were given.
        obstacles: (N + W, 3) float32 `points`, then points that close unseen vertical faces.
    """

    points: np.ndarray
    normals: np.ndarray
    colors: np.ndarray
    obstacles: np.ndarray


def extract_surface(
    points: np.ndarray,
    normals: np.ndarray,
    config: AntipodalConfig,
    colors: np.ndarray | None = None,
) -> ObjectSurface:
    """Thin a fused cloud, drop the table and close unseen walls.

    Args:
        points: (N, 3) world positions, metres; the table is at z = 0.
        normals: (N, 3) unit normals.
        config: The sampler's settings.
        colors: (N, 3) RGB, 0..1, if somebody asks for them.

    Returns:
        The surface; it may be empty.
    """
    above = points[:, 2] > config.object_min_height_m
    colors = np.zeros_like(points) if colors is None else colors
    rows = np.concatenate([points[above], normals[above], colors[above]], axis=1)
    rows = voxel_means(rows, voxel_keys(rows[:, :3], config.voxel_m))
    rows = rows[_is_supported(rows[:, :2])]
    thinned, mean_normals = rows[:, :3], rows[:, 3:6]
    lengths = np.linalg.norm(mean_normals, axis=1, keepdims=True)
    walls = unseen_walls(thinned, config.wall_step_m)
    return ObjectSurface(
        points=thinned,
        normals=mean_normals / np.maximum(lengths, 1e-6),
        colors=rows[:, 6:],
        obstacles=np.concatenate([thinned, walls]),
    )


def _is_supported(xy: np.ndarray) -> np.ndarray:
    """Mask of the points (N, 2) that have company."""
    if not len(xy):
        return np.zeros(0, bool)
    cells = np.floor(xy / _SUPPORT_CELL_M).astype(np.int64)
    x, y = (cells - cells.min(axis=0) + 1).T
    count = np.zeros((x.max() + 2, y.max() + 2), np.int64)
    np.add.at(count, (x, y), 1)
    around = [count[x + dx, y + dy] for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
    return np.sum(around, axis=0) >= _MIN_SUPPORT


def voxel_keys(points: np.ndarray, edge_m: float) -> np.ndarray:
    """Number the cells of a regular grid in which points lie.

    Args:
        points: (N, D) coordinates, metres, D = 2 or 3.
        edge_m: Edge of a cell, metres.

    Returns:
        (N,) int64 keys; equal keys mean the same cell, and cells are numbered along the last
        axis first.
    """
    # 20 bits an axis: half a million cells to either side of the origin.
    cells = np.floor(points / edge_m).astype(np.int64) + (1 << 19)
    keys = cells[:, 0]
    for axis in range(1, points.shape[1]):
        keys = (keys << 20) | cells[:, axis]
    return keys


def voxel_means(rows: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Average the rows of every cell.

    Args:
        rows: (N, D) values.
        keys: (N,) cells from `voxel_keys`.

    Returns:
        (V, D) float32 means, in the order of the keys.
    """
    if not len(rows):
        return rows.astype(np.float32)
    order = np.argsort(keys, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(keys[order]) != 0])
    counts = np.diff(np.r_[starts, len(keys)])
    return (np.add.reduceat(rows[order], starts, axis=0) / counts[:, None]).astype(np.float32)


def thin(points: np.ndarray, edge_m: float) -> np.ndarray:
    """Replace the points of every voxel by their mean.

    Args:
        points: (N, 3) positions, metres.
        edge_m: Edge of a voxel, metres.

    Returns:
        (V, 3) float32 means.
    """
    return voxel_means(points, voxel_keys(points, edge_m))


def unseen_walls(points: np.ndarray, step_m: float) -> np.ndarray:
    """Close vertical faces below edges, where the cameras look past them.

    The highest point of every vertical column is repeated downwards to the top of the lowest
    neighbouring column. The wall stands under the observed edge, not around it: a wall 3 mm
    thicker than the object already takes the room of one grasp in twelve in clutter.

    Args:
        points: (N, 3) float32 object points over the table, metres.
        step_m: Width of a column and spacing of the wall's points, metres.

    Returns:
        (W, 3) float32 points.
    """
    if not len(points):
        return points
    cells = np.floor(points[:, :2] / step_m).astype(np.int64)
    cells -= cells.min(axis=0) - 1
    order = np.lexsort((points[:, 2], cells[:, 1], cells[:, 0]))
    is_last = np.r_[np.diff(cells[order], axis=0).any(axis=1), True]
    tops = points[order[is_last]]
    x, y = cells[order[is_last]].T
    height = np.zeros(cells.max(axis=0) + 2)
    height[x, y] = tops[:, 2]
    neighbours = [height[x - 1, y], height[x + 1, y], height[x, y - 1], height[x, y + 1]]
    drop = tops[:, 2] - np.minimum.reduce(neighbours)
    count = np.floor(drop / step_m).astype(np.int64).clip(0)
    column = np.repeat(np.arange(len(tops)), count)
    rank = np.arange(len(column)) - np.repeat(np.cumsum(count) - count, count)
    walls = tops[column]
    walls[:, 2] -= (rank + 1) * np.float32(step_m)
    return walls


def choose_seeds(
    points: np.ndarray, config: AntipodalConfig, rng: np.random.Generator
) -> np.ndarray:
    """Pick surface points that are spread evenly.

    Args:
        points: (N, 3) surface points, metres.
        config: The sampler's settings.
        rng: Chooses the grid's offset and the point of every voxel.

    Returns:
        (S,) sorted indices into `points`, S at most `max_seeds`.
    """
    spacing = config.seed_spacing_m
    shuffled = rng.permutation(len(points))
    shifted = points[shuffled] + rng.uniform(0, spacing, 3)
    while True:
        _, first = np.unique(voxel_keys(shifted, spacing), return_index=True)
        if len(first) <= config.max_seeds:
            return np.sort(shuffled[first])
        # The number of voxels that a surface meets falls with the square of their edge.
        spacing *= max(1.02, (len(first) / config.max_seeds) ** 0.5)
