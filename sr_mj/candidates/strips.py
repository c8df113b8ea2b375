"""Finger placement by scanning the strip of surface that the closing fingers sweep.

Seen along the approach, the fingers sweep a strip 22 mm wide. The strip's height profile along the
closing direction says, for every depth, where a finger fits down beside the object, how wide the
object is there, and how steep its flanks are, also on a side whose face no camera saw.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch

from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.frames import Hypotheses

_BIN_M = 0.004
_HALF_BINS = 17
_NUM_BINS = 2 * _HALF_BINS + 1
_NUM_LANES = 3
# Half a pad and 2 mm, so that a finger has room at its sides too.
_STRIP_HALF_M = 0.013
_LANE_M = 2 * _STRIP_HALF_M / _NUM_LANES
# Lines of the height image in a lane: seeds lie anywhere, and a strip begins at the nearest line.
_LINES_A_LANE = 4
_LINE_M = _LANE_M / _LINES_A_LANE
# BLAS sums in an order that depends on where an array lies in memory. Multiples of 2^-12 m (0.24
# mm) below half a metre, times multiples of 2^-11: a sum of three has 24 bits, which float32 holds.
# The products are exact in any order, and the same seed gives the same bytes.
_POINT_STEP_M, _AXIS_STEP = 2.0**-12, 2.0**-11
_EMPTY = -1.0
# Points this little above the fingertips' plane do not stop a finger; noise does as much.
_TOUCH_M = 0.001
# The highest of many noisy points stands out by this much.
_NOISE_M = 0.0015
# How far inwards from the contact an outline that runs askew is followed.
_EDGE_BINS = 6
# The finger's thickness and 2 mm.
_FINGER_BINS = 4
_MIN_DEPTH_M = 0.0035
# Signs of the outward closing direction at the left and the right contact.
OUTWARD = np.array([-1.0, 1.0], np.float32)


@dataclass(frozen=True, kw_only=True)
class FingerPlacements:
    """Places where the object at a seed fits between the fingers. All arrays have H rows.

    Attributes:
        seed: int64 index of the seed.
        rotation: (H, 3, 3) float32, tool to world.
        depth_m: Distance of the fingertips' plane beyond the seed, along the approach.
        center_m: Middle between the contacts along the closing direction, from the seed.
        width_m: Distance between the contacts.
        engagement_m: How far the fingertips reach below the object's highest point.
        outline: (H, 2, 3) float32 unit normals of the left and right flank, tool frame, as the
            profile shows them.
    """

    seed: np.ndarray
    rotation: np.ndarray
    depth_m: np.ndarray
    center_m: np.ndarray
    width_m: np.ndarray
    engagement_m: np.ndarray
    outline: np.ndarray

    def take(self, rows: np.ndarray | slice) -> "FingerPlacements":
        """Select rows by index, mask or slice."""
        return FingerPlacements(**{name: value[rows] for name, value in vars(self).items()})

    @property
    def alignment(self) -> np.ndarray:
        """(H, 2) cosines between the outward closing directions and the flanks' normals."""
        return self.outline[:, :, 0] * OUTWARD

    @property
    def opposition(self) -> np.ndarray:
        """(H,) cosine between the two flanks' normals; -1 is antipodal."""
        return (self.outline[:, 0] * self.outline[:, 1]).sum(axis=1)


def scan_strips(
    points: np.ndarray, origins: np.ndarray, hypotheses: Hypotheses
) -> tuple[np.ndarray, np.ndarray]:
    """Measure height profiles under the gripper.

    Seen along one approach, all strips with the same closing direction are windows of one image
    of heights; every orientation has its own.

    Args:
        points: (N, 3) float32 positions of everything on the table, metres.
        origins: (S, 3) positions of the seeds.
        hypotheses: H pairs of seed and orientation.

    Returns:
        Profiles (H, lanes, bins) float32: the largest height towards the gripper over the seed,
        metres; -1 where the strip holds no point. And (H,) float32 positions of the middle bin
        along the closing direction, from the seed.
    """
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    # (O, 3, N): coordinates of the points along the tool's axes, for every orientation.
    axes = _rounded(hypotheses.rotations.transpose(0, 2, 1), _AXIS_STEP)
    local = torch.matmul(axes, _rounded(points - middle, _POINT_STEP_M).T).numpy()
    seeds = torch.matmul(axes, _rounded(origins - middle, _POINT_STEP_M).T).numpy()
    profiles = np.empty((len(hypotheses.seed), _NUM_LANES, _NUM_BINS), np.float32)
    shift_m = np.empty(len(hypotheses.seed), np.float32)
    order = np.argsort(hypotheses.orientation, kind="stable")
    ends = np.searchsorted(hypotheses.orientation[order], np.arange(len(local) + 1))
    for index, (start, end) in enumerate(pairwise(ends)):
        rows = order[start:end]
        at = seeds[index][:, hypotheses.seed[rows]]
        profiles[rows], shift_m[rows] = _windows(local[index], at)
    return profiles, shift_m


def _rounded(values: np.ndarray, step: float) -> torch.Tensor:
    return torch.from_numpy((np.rint(values / step) * step).astype(np.float32))


def _windows(local: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Profiles (R, lanes, bins) and shifts (R,) at seeds (3, R) among points (3, N)."""
    # Room for a window at every border.
    low = local[:2].min(axis=1) - [_NUM_BINS * _BIN_M, 2 * _STRIP_HALF_M]
    column = ((local[0] - low[0]) * (1 / _BIN_M)).astype(np.int64)
    line = ((local[1] - low[1]) * (1 / _LINE_M)).astype(np.int64)
    shape = (line.max() + 4 * _NUM_LANES * _LINES_A_LANE, column.max() + 2 * _NUM_BINS)
    image = np.full(shape, 2 * _EMPTY, np.float32)
    np.maximum.at(image.reshape(-1), line * shape[1] + column, -local[2])
    lanes = np.maximum(image[:-1], image[1:])
    lanes = np.maximum(lanes[:-2], lanes[2:])
    column = ((at[0] - low[0]) * (1 / _BIN_M)).astype(np.int64)
    line = np.rint((at[1] - low[1] - _STRIP_HALF_M) * (1 / _LINE_M)).astype(np.int64)
    first = line * shape[1] + column - _HALF_BINS
    window = np.arange(_NUM_LANES)[:, None] * (_LINES_A_LANE * shape[1]) + np.arange(_NUM_BINS)
    profiles = lanes.reshape(-1)[first[:, None, None] + window]
    shift = (column + 0.5) * _BIN_M + low[0] - at[0]
    return np.maximum(profiles + at[2][:, None, None], _EMPTY), shift


def place_fingers(
    seed: np.ndarray,
    rotation: np.ndarray,
    depth_m: np.ndarray,
    profiles: np.ndarray,
    shift_m: np.ndarray,
    config: AntipodalConfig,
) -> FingerPlacements:
    """Find the nearest gaps for the two fingers on either side of the seed.

    Args:
        seed: (H,) seed indices.
        rotation: (H, 3, 3) orientations.
        depth_m: (H,) depths of the fingertips beyond the seed.
        profiles: (H, lanes, bins) profiles from `scan_strips`.
        shift_m: (H,) positions of their middle bins.
        config: The sampler's settings.

    Returns:
        The placements that exist, a subset of the H hypotheses.
    """
    tip = -depth_m[:, None]
    highest = profiles.max(axis=1)
    free = highest <= tip + _TOUCH_M
    gap = free[:, : 1 - _FINGER_BINS].copy()
    for shift in range(1, _FINGER_BINS):
        gap &= free[:, shift : _NUM_BINS - _FINGER_BINS + 1 + shift]
    last_left = _HALF_BINS - _FINGER_BINS
    left_gaps, right_gaps = gap[:, : last_left + 1], gap[:, _HALF_BINS + 1 :]
    # Contact bins: the first ones that are not free when a finger comes from outside.
    left = last_left - np.argmax(left_gaps[:, ::-1], axis=1) + _FINGER_BINS
    right = _HALF_BINS + np.argmax(right_gaps, axis=1)
    width = (right - left + 1) * _BIN_M
    bins = np.arange(_NUM_BINS)
    between = (bins >= left[:, None]) & (bins <= right[:, None])
    engagement = np.where(between, highest, _EMPTY).max(axis=1) + depth_m
    gripper = config.gripper
    finger_length = gripper.palm_above_tool_m + gripper.tip_below_tool_m
    found = left_gaps.any(axis=1) & right_gaps.any(axis=1)
    found &= (width <= gripper.max_width_m) & (engagement < finger_length - config.clearance_m)
    rows = np.flatnonzero(found)
    left, right = left[rows], right[rows]
    outline = _outline(profiles[rows] - tip[rows][..., None], left, right)
    return FingerPlacements(
        seed=seed[rows],
        rotation=rotation[rows],
        depth_m=depth_m[rows],
        center_m=((left + right) / 2 - _HALF_BINS).astype(np.float32) * _BIN_M + shift_m[rows],
        width_m=width[rows].astype(np.float32),
        engagement_m=engagement[rows],
        outline=outline,
    )


def _outline(heights: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Normals of both flanks from heights (H, lanes, bins) over the fingertips' plane."""
    normals = np.empty((len(heights), 2, 3), np.float32)
    for side, (edge, sign) in enumerate(((left, 1), (right, -1))):
        # (H, lanes, 8): bins from the contact inwards.
        steps = edge[:, None] + sign * np.arange(_EDGE_BINS + 3)
        inner = np.take_along_axis(heights, steps.clip(0, _NUM_BINS - 1)[:, None], axis=2)
        solid = inner[..., :_EDGE_BINS] > _TOUCH_M
        is_hit = solid.any(axis=2)
        first = np.where(is_hit, solid.argmax(axis=2), _EDGE_BINS)
        yaw = (first[:, 2] - first[:, 0]) * (sign * _BIN_M / (2 * _LANE_M))
        rise = np.take_along_axis(inner, first[..., None] + np.arange(3), axis=2) - _NOISE_M
        steepness = (rise / (np.arange(1, 4) * _BIN_M)).max(axis=2).clip(1e-3)
        steepness = (steepness * is_hit).sum(axis=1) / is_hit.sum(axis=1).clip(1)
        normal = np.stack(
            [np.full(len(edge), -sign), sign * yaw, -1 / steepness.clip(1e-3)], axis=1
        )
        normals[:, side] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return normals


def depth_hypotheses(
    seed_height_m: np.ndarray, rotation: np.ndarray, config: AntipodalConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Combine orientations with depths that keep the fingertips over the table.

    Args:
        seed_height_m: (H,) heights of the seeds over the table.
        rotation: (H, 3, 3) orientations.
        config: The sampler's settings.

    Returns:
        Hypothesis index (G,) and depth (G,) in metres. The last depth of a hypothesis that the
        table cuts short is the deepest that it allows.
    """
    descent = -rotation[:, 2, 2]
    corner = config.gripper.pad_half_m[0] * np.abs(rotation[:, 2, 1])
    deepest = (seed_height_m - config.min_tip_height_m - corner) / descent.clip(0.1)
    wanted = np.asarray(config.depths_m, np.float32)
    shallower = np.r_[0.0, wanted[:-1]]
    depth = np.minimum(wanted, deepest[:, None])
    # A cut depth is worth a hypothesis of its own only if it gains 2 mm on the level before.
    useful = (depth >= _MIN_DEPTH_M) & (depth > shallower + 0.002)
    row, level = np.nonzero(useful)
    return row, depth[row, level].astype(np.float32)
