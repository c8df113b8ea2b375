"""Finger placement by scanning the strip of surface that the closing fingers sweep.

Seen along the approach, the fingers sweep a strip 22 mm wide. The strip's height profile along the
closing direction says, for every depth, where a finger fits down beside the object, how wide the
object is there, and how steep its flanks are, also on a side whose face no camera saw.
"""

from dataclasses import dataclass

import numpy as np
import torch

from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.neighbourhoods import Neighbourhoods, exact_axes

_BIN_M = 0.004
_HALF_BINS = 17
_NUM_BINS = 2 * _HALF_BINS + 1
_NUM_LANES = 3
# Half a pad and 2 mm, so that a finger has room at its sides too.
_STRIP_HALF_M = 0.013
_LANE_M = 2 * _STRIP_HALF_M / _NUM_LANES
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
_SEEDS_A_CHUNK = 24
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
    around: Neighbourhoods, rotations: np.ndarray, valid: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measure height profiles under the gripper.

    Args:
        around: Points around every one of S seeds.
        rotations: (S, O, 3, 3) float32 orientations, tool to world.
        valid: (S, O) mask of the orientations to scan.

    Returns:
        Seed (H,) and orientation (H,) indices, and profiles (H, lanes, bins) float32: the largest
        height towards the gripper over the seed, metres; -1 where the strip holds no point.
    """
    seed, orientation = np.nonzero(valid)
    profiles = np.empty((len(seed), _NUM_LANES, _NUM_BINS), np.float32)
    # Seeds with neighbourhoods of similar size share a chunk, so that little padding is scanned.
    by_size = np.argsort(around.count, kind="stable")
    is_row = np.full(valid.shape, -1)
    is_row[seed, orientation] = np.arange(len(seed))
    for start in range(0, len(by_size), _SEEDS_A_CHUNK):
        part = by_size[start : start + _SEEDS_A_CHUNK]
        offsets = around.offsets[part, : around.count[part[-1]]]
        rows = is_row[part]
        profiles[rows[rows >= 0]] = _scan(offsets, rotations[part])[rows >= 0]
    return seed, orientation, profiles


def _scan(offsets: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Profiles (s, O, lanes, bins) of a few seeds."""
    count, num_orientations = rotations.shape[:2]
    local = torch.from_numpy(offsets)
    # (3, s, 3, O): the world components of each tool axis.
    axes = exact_axes(rotations).permute(3, 0, 2, 1).contiguous()
    y = torch.bmm(local, axes[1]).flatten()
    keep = torch.nonzero(y.abs() < _STRIP_HALF_M)[:, 0]
    x = torch.bmm(local, axes[0]).flatten()[keep]
    height = -torch.bmm(local, axes[2]).flatten()[keep]
    lane = ((y[keep] + _STRIP_HALF_M) * (1 / _LANE_M)).long().clamp_(max=_NUM_LANES - 1)
    column = (x * (1 / _BIN_M) + (_HALF_BINS + 1.5)).long().clamp_(0, _NUM_BINS + 1)
    of_seed = keep // (offsets.shape[1] * num_orientations)
    row = of_seed * num_orientations + keep % num_orientations
    # One bin more at each end takes what lies outside.
    profile = torch.full((count * num_orientations * _NUM_LANES * (_NUM_BINS + 2),), _EMPTY)
    profile.scatter_reduce_(0, (row * _NUM_LANES + lane) * (_NUM_BINS + 2) + column, height, "amax")
    return profile.view(count, num_orientations, _NUM_LANES, -1)[..., 1:-1].numpy()


def place_fingers(
    seed: np.ndarray,
    rotation: np.ndarray,
    depth_m: np.ndarray,
    profiles: np.ndarray,
    config: AntipodalConfig,
) -> FingerPlacements:
    """Find the nearest gaps for the two fingers on either side of the seed.

    Args:
        seed: (H,) seed indices.
        rotation: (H, 3, 3) orientations.
        depth_m: (H,) depths of the fingertips beyond the seed.
        profiles: (H, lanes, bins) profiles from `scan_strips`.
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
        center_m=((left + right) / 2 - _HALF_BINS).astype(np.float32) * _BIN_M,
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
