"""Collision of the open gripper, swept along its approach, with the cloud and the table."""

import numpy as np
import torch

from sr_mj.candidates.config import AntipodalConfig

_ROWS_A_CHUNK = 32
_CELL_M = 0.05


def swept_boxes(opening_m: np.ndarray, config: AntipodalConfig) -> tuple[np.ndarray, np.ndarray]:
    """Bound the gripper and the arm's last link over the straight approach.

    Args:
        opening_m: (K,) distances between the pads.
        config: The sampler's settings.

    Returns:
        Lower and upper corners (K, 4, 3) in the tool frame, metres: finger at negative x, finger
        at positive x, palm, wrist. Palm and wrist reach back over the approach; the palm's sweep
        covers that of the fingers behind them.
    """
    centers, halves = config.gripper.boxes(0.0)
    flange = centers[2, 2] - halves[2, 2]
    wrist_half = np.array([*config.wrist_half_m, config.wrist_length_m / 2])
    centers = np.vstack([centers, [0, 0, flange - wrist_half[2]]])
    halves = np.vstack([halves, wrist_half])
    low = np.tile(centers - halves, (len(opening_m), 1, 1))
    high = np.tile(centers + halves, (len(opening_m), 1, 1))
    travel = np.outer(opening_m, [-0.5, 0.5])
    low[:, :2, 0] += travel
    high[:, :2, 0] += travel
    low[:, 2:, 2] -= config.pregrasp_m
    return low.astype(np.float32), high.astype(np.float32)


def table_clearance(Ts_world_tool: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Find the lowest point of boxes that move with the tool.

    Args:
        Ts_world_tool: (K, 4, 4) poses.
        low: (K, B, 3) lower corners in the tool frame, metres.
        high: (K, B, 3) upper corners.

    Returns:
        (K,) heights over z = 0, metres.
    """
    up = Ts_world_tool[:, None, 2, :3]
    lowest = np.minimum(low * up, high * up).sum(axis=-1).min(axis=1)
    return Ts_world_tool[:, 2, 3] + lowest


def hits_points(
    Ts_world_tool: np.ndarray, low: np.ndarray, high: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Test boxes that move with the tool against points.

    Args:
        Ts_world_tool: (K, 4, 4) poses.
        low: (K, B, 3) lower corners in the tool frame, metres.
        high: (K, B, 3) upper corners.
        points: (N, 3) float32 world positions.

    Returns:
        (K,) mask of the poses at which a box holds a point.
    """
    hits = np.zeros(len(Ts_world_tool), bool)
    # Poses that stand together share a chunk, and only the points around them are looked at.
    order = np.lexsort(np.floor(Ts_world_tool[:, :2, 3].T / _CELL_M))
    for start in range(0, len(hits), _ROWS_A_CHUNK):
        rows = order[start : start + _ROWS_A_CHUNK]
        poses, lower, upper = Ts_world_tool[rows], low[rows], high[rows]
        nearby = points[_is_within_bounds(points, poses, lower, upper)]
        axes = poses[:, :3, :3].transpose(0, 2, 1)
        shift = torch.from_numpy(np.einsum("kij,kj->ki", axes, poses[:, :3, 3]))
        # In double precision: BLAS rounds differently from call to call, and a point on the border
        # of a box in single precision would then be in or out by chance.
        local = torch.from_numpy(axes.reshape(-1, 3)) @ torch.from_numpy(nearby.T.astype(float))
        local = (local.view(len(rows), 3, -1) - shift[..., None]).float()
        hits[rows] = _any_inside(local, torch.from_numpy(lower), torch.from_numpy(upper)).numpy()
    return hits


def _is_within_bounds(
    points: np.ndarray, poses: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Mask of the points inside the common axis-aligned world bounds of all boxes."""
    rotation, position = poses[:, :3, :3], poses[:, None, :3, 3]
    center = np.einsum("kij,kbj->kbi", rotation, (low + high) / 2) + position
    reach = np.einsum("kij,kbj->kbi", np.abs(rotation), (high - low) / 2)
    lower, upper = (center - reach).min(axis=(0, 1)), (center + reach).max(axis=(0, 1))
    return ((points >= lower) & (points <= upper)).all(axis=1)


def _any_inside(local: torch.Tensor, low: torch.Tensor, high: torch.Tensor) -> torch.Tensor:
    """Mask (k,) of rows of points (k, 3, n) of which one lies in a box (k, b, 3)."""
    hit = torch.zeros(len(local), dtype=torch.bool)
    for box in range(low.shape[1]):
        inside = torch.ones_like(local[:, 0], dtype=torch.bool)
        for axis in range(3):
            inside &= local[:, axis] > low[:, box, axis, None]
            inside &= local[:, axis] < high[:, box, axis, None]
        hit |= inside.any(dim=1)
    return hit
