"""Points sorted into vertical columns, for finding those in many small regions at once."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Columns:
    """A square grid of columns over points.

    Attributes:
        order: (N,) int64 indices of the points, column after column; along y columns follow each
            other, so that a rectangle meets one run of points for every x.
        starts: (X * Y + 1,) int64 where each column begins in `order`.
        shape: Number of columns along x and y.
        lowest: (2,) x and y at which the grid begins, metres.
        edge_m: Edge of a column.
    """

    order: np.ndarray
    starts: np.ndarray
    shape: tuple[int, int]
    lowest: np.ndarray
    edge_m: float

    def pairs(self, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pair rectangles with the points in all columns that they meet.

        Args:
            lower: (R, 2) lower corners, metres.
            upper: (R, 2) upper corners.

        Returns:
            Rectangles (P,) in rising order, and points (P,).
        """
        num_x, num_y = self.shape
        first = np.floor((lower - self.lowest) / self.edge_m).astype(np.int64).clip(0)
        last = np.floor((upper - self.lowest) / self.edge_m).astype(np.int64)
        last = np.minimum(last, [num_x - 1, num_y - 1])
        # One run for every x of a rectangle.
        size = last - first + 1
        num_runs = np.where(size.min(axis=1) > 0, size[:, 0], 0)
        row = np.repeat(np.arange(len(lower)), num_runs)
        x = first[row, 0] + _count_up(num_runs)
        begin = self.starts[x * num_y + first[row, 1]]
        length = self.starts[x * num_y + last[row, 1] + 1] - begin
        return np.repeat(row, length), self.order[np.repeat(begin, length) + _count_up(length)]


def sort_into_columns(points: np.ndarray, edge_m: float) -> Columns:
    """Sort points.

    Args:
        points: (N, 3) positions, metres; N may be 0.
        edge_m: Edge of a column, metres.

    Returns:
        The columns.
    """
    lowest = points[:, :2].min(axis=0) if len(points) else np.zeros(2)
    cells = np.floor((points[:, :2] - lowest) / edge_m).astype(np.int64)
    num_x, num_y = cells.max(axis=0, initial=0) + 1
    keys = cells[:, 0] * num_y + cells[:, 1]
    order = np.argsort(keys, kind="stable")
    starts = np.searchsorted(keys[order], np.arange(num_x * num_y + 1))
    return Columns(
        order=order,
        starts=starts,
        shape=(int(num_x), int(num_y)),
        lowest=lowest,
        edge_m=edge_m,
    )


def world_bounds(
    poses: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bound boxes that move with a pose.

    Args:
        poses: (K, 4, 4) poses in the world.
        low: (K, 3) lower corners in the pose's frame, metres.
        high: (K, 3) upper corners.

    Returns:
        Corners (K, 3), (K, 3) of the axis-aligned bounds in the world.
    """
    rotation = poses[:, :3, :3]
    center = np.einsum("kij,kj->ki", rotation, (low + high) / 2) + poses[:, :3, 3]
    reach = np.einsum("kij,kj->ki", np.abs(rotation), (high - low) / 2)
    return center - reach, center + reach


def points_in_boxes(
    points: np.ndarray,
    columns: Columns,
    poses: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the points inside boxes that move with a pose.

    Args:
        points: (N, 3) positions, metres.
        columns: The same points, sorted.
        poses: (K, 4, 4) poses in the world.
        low: (K, 3) lower corners in the pose's frame, metres.
        high: (K, 3) upper corners.

    Returns:
        Boxes (P,) in rising order, and points (P,).
    """
    if not len(poses):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    lower, upper = world_bounds(poses, low, high)
    row, point = columns.pairs(lower[:, :2], upper[:, :2])
    # One array a component: taking rows of matrices for a million pairs costs five times as much.
    x, y, z = points.T.astype(np.float32)
    height, lower, upper = z[point], lower[:, 2].astype(np.float32), upper[:, 2].astype(np.float32)
    kept = np.flatnonzero((height >= lower[row]) & (height <= upper[row]))
    row, point = row[kept], point[kept]
    # The thinnest axis first: it leaves few points for the others.
    for axis in np.argsort((high - low).mean(axis=0), kind="stable"):
        along = poses[:, :3, axis]
        origin = (along * poses[:, :3, 3]).sum(axis=1)
        ax, ay, az = along.T.astype(np.float32)
        offset = x[point] * ax[row] + y[point] * ay[row] + z[point] * az[row]
        first = (low[:, axis] + origin).astype(np.float32)
        last = (high[:, axis] + origin).astype(np.float32)
        kept = np.flatnonzero((offset > first[row]) & (offset < last[row]))
        row, point = row[kept], point[kept]
    return row, point


def _count_up(lengths: np.ndarray) -> np.ndarray:
    """Concatenate 0, 1, ..., n - 1 for every n."""
    return np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
