"""Orientations of the gripper worth trying at a seed."""

import numpy as np

from sr_mj.candidates.config import AntipodalConfig

# Below this share of the normal that is horizontal the surface says nothing about the closing
# direction, and the outline around the seed is asked instead.
_MIN_HORIZONTAL = 0.35
_OUTLINE_RADIUS_M, _OUTLINE_HEIGHT_M = 0.03, 0.012
# A finger may come a little from behind the seed's surface: normals are noisy at edges.
_MAX_FROM_BEHIND = 0.3
_NORMAL_APPROACH_DEG = (12.0, 62.0)


def seed_frames(
    normals: np.ndarray, offsets: np.ndarray, config: AntipodalConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Propose orientations for every seed.

    Args:
        normals: (S, 3) unit normals at the seeds.
        offsets: (S, M, 3) neighbouring points relative to their seed, metres; unused places hold
            coordinates far away.
        config: The sampler's settings.

    Returns:
        Rotations (S, O, 3, 3) that map tool to world coordinates, and a mask (S, O) of those that
        make sense at their seed.
    """
    rolls = np.arange(config.num_rolls) * np.pi / config.num_rolls
    azimuth = _base_azimuth(normals, offsets)[:, None] + rolls
    closing = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=-1)
    down = np.broadcast_to([0.0, 0.0, -1.0], closing.shape)
    side = np.cross(down, closing)
    groups = [
        _frame(closing, np.cos(tilt) * down - np.sin(tilt) * side)
        for tilt in np.radians(config.tilts_deg)
    ]
    inward = np.broadcast_to(-normals[:, None], closing.shape)
    groups.append(_frame(closing, inward))
    rotations = np.concatenate(groups, axis=1)

    from_behind = np.einsum("soi,si->so", rotations[..., 2], normals)
    valid = from_behind < _MAX_FROM_BEHIND
    low, high = np.cos(np.radians(_NORMAL_APPROACH_DEG))
    is_tilted = (normals[:, 2] < low) & (normals[:, 2] > high)
    valid[:, -config.num_rolls :] &= is_tilted[:, None]
    return rotations.astype(np.float32), valid


def _frame(closing: np.ndarray, approach: np.ndarray) -> np.ndarray:
    """Complete (..., 3, 3) frames; the closing direction is made orthogonal to the approach."""
    closing = closing - (closing * approach).sum(-1, keepdims=True) * approach
    closing = closing / np.maximum(np.linalg.norm(closing, axis=-1, keepdims=True), 1e-6)
    return np.stack([closing, np.cross(approach, closing), approach], axis=-1)


def _base_azimuth(normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Guess the closing direction: the normal's, or across the narrow side of the outline."""
    x, y = offsets[..., 0], offsets[..., 1]
    near = (x**2 + y**2 < _OUTLINE_RADIUS_M**2) & (np.abs(offsets[..., 2]) < _OUTLINE_HEIGHT_M)
    weight = near / np.maximum(near.sum(axis=1, keepdims=True), 1)
    dx = x - (x * weight).sum(axis=1, keepdims=True)
    dy = y - (y * weight).sum(axis=1, keepdims=True)
    xx, yy, xy = ((a * b * weight).sum(axis=1) for a, b in ((dx, dx), (dy, dy), (dx, dy)))
    narrow = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
    is_side = np.linalg.norm(normals[:, :2], axis=1) > _MIN_HORIZONTAL
    return np.where(is_side, np.arctan2(normals[:, 1], normals[:, 0]), narrow)
