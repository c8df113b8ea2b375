"""Collision of the open gripper, swept along its approach, with the cloud and the table."""

import numpy as np

from sr_mj.candidates.columns import points_in_boxes, sort_into_columns, world_bounds
from sr_mj.candidates.config import AntipodalConfig

_NUM_LEVELS = 5
_COLUMN_M = 0.012


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
    if not len(points):
        return hits
    # Most palms are above most points: boxes are tested only against what is as high as they.
    levels = np.linspace(points[:, 2].min(), points[:, 2].max(), _NUM_LEVELS)
    above = [points[points[:, 2] >= level] for level in levels]
    columns = [sort_into_columns(part, _COLUMN_M) for part in above]
    for box in range(low.shape[1]):
        lowest = world_bounds(Ts_world_tool, low[:, box], high[:, box])[0][:, 2]
        level_of = (np.searchsorted(levels, lowest, side="right") - 1).clip(0)
        # A pose that one box has decided needs no other.
        is_open = ~hits & (lowest <= levels[-1])
        for level in range(_NUM_LEVELS):
            rows = np.flatnonzero(is_open & (level_of == level))
            boxes = Ts_world_tool[rows], low[rows, box], high[rows, box]
            hits[rows[points_in_boxes(above[level], columns[level], *boxes)[0]]] = True
    return hits
