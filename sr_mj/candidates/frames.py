"""Orientations of the gripper worth trying at a seed, out of a fixed set that all seeds share."""

from dataclasses import dataclass

import numpy as np

from sr_mj.candidates.columns import sort_into_columns
from sr_mj.candidates.config import AntipodalConfig

# Below this share of the normal that is horizontal the surface says nothing about the closing
# direction, and the outline around the seed is asked instead.
_MIN_HORIZONTAL = 0.35
_OUTLINE_RADIUS_M, _OUTLINE_HEIGHT_M = 0.03, 0.012
# A finger may come a little from behind the seed's surface: normals are noisy at edges.
_MAX_FROM_BEHIND = 0.3


@dataclass(frozen=True, kw_only=True)
class Hypotheses:
    """Seeds paired with orientations. Arrays have H rows but for the last.

    Attributes:
        seed: int64 index of the seed.
        orientation: int64 index of the orientation.
        rotations: (O, 3, 3) float32 set of orientations, tool to world.
    """

    seed: np.ndarray
    orientation: np.ndarray
    rotations: np.ndarray


def gripper_orientations(config: AntipodalConfig) -> np.ndarray:
    """List the orientations, evenly spread closing directions for every tilt.

    Args:
        config: The sampler's settings.

    Returns:
        (T * A, 3, 3) float32 rotations, tool to world: tilts first, then azimuths over half a
        turn. The set turned by half a turn about the vertical is the set itself if the tilts come
        in pairs, because the gripper is symmetric.
    """
    azimuth = np.arange(config.num_azimuths) * (np.pi / config.num_azimuths)
    closing = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=-1)
    down = np.broadcast_to([0.0, 0.0, -1.0], closing.shape)
    side = np.cross(down, closing)
    frames = []
    for tilt in np.radians(config.tilts_deg):
        approach = np.cos(tilt) * down - np.sin(tilt) * side
        frames.append(np.stack([closing, np.cross(approach, closing), approach], axis=-1))
    return np.concatenate(frames).astype(np.float32)


def choose_orientations(
    points: np.ndarray, normals: np.ndarray, seeds: np.ndarray, config: AntipodalConfig
) -> Hypotheses:
    """Pair every seed with the orientations that make sense there.

    Args:
        points: (N, 3) surface points, metres.
        normals: (N, 3) their unit normals.
        seeds: (S,) indices of the seeds.
        config: The sampler's settings.

    Returns:
        The pairs, by seed.
    """
    step = np.pi / config.num_azimuths
    base = np.rint(_base_azimuth(points, normals, seeds) / step).astype(np.int64)
    roll = np.rint(np.arange(config.num_rolls) * config.num_azimuths / config.num_rolls)
    azimuth = (base[:, None] + roll.astype(np.int64)) % config.num_azimuths
    tilt = np.arange(len(config.tilts_deg)) * config.num_azimuths
    orientation = (tilt[:, None] + azimuth[:, None]).reshape(len(seeds), -1)
    rotations = gripper_orientations(config)
    from_behind = np.einsum("si,soi->so", normals[seeds], rotations[orientation, :, 2])
    seed, place = np.nonzero(from_behind < _MAX_FROM_BEHIND)
    return Hypotheses(seed=seed, orientation=orientation[seed, place], rotations=rotations)


def _base_azimuth(points: np.ndarray, normals: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Guess the closing direction: the normal's, or across the narrow side of the outline."""
    columns = sort_into_columns(points, _OUTLINE_RADIUS_M / 3)
    origins = points[seeds]
    reach = np.float32(_OUTLINE_RADIUS_M)
    seed, point = columns.pairs(origins[:, :2] - reach, origins[:, :2] + reach)
    x, y, z = (points[point] - origins[seed]).T.astype(float)
    near = (x**2 + y**2 < _OUTLINE_RADIUS_M**2) & (np.abs(z) < _OUTLINE_HEIGHT_M)
    seed, x, y = seed[near], x[near], y[near]
    count = np.bincount(seed, minlength=len(seeds)).clip(1)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(seed, values, len(seeds)) / count

    dx, dy = x - mean(x)[seed], y - mean(y)[seed]
    narrow = 0.5 * np.arctan2(2 * mean(dx * dy), mean(dx * dx) - mean(dy * dy)) + np.pi / 2
    across = normals[seeds, :2]
    is_side = np.linalg.norm(across, axis=1) > _MIN_HORIZONTAL
    return np.where(is_side, np.arctan2(across[:, 1], across[:, 0]), narrow)
