"""The geometric prior of a grasp, and the choice of a few well-spread ones."""

import numpy as np

from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.contacts import Contacts
from sr_mj.candidates.surface import voxel_keys

# Deeper engagement than most of a pad's height gains nothing.
_FULL_ENGAGEMENT_M = 0.03
_OFFSET_SCALE_M = 0.04
_FULL_AREA = 0.4
_COMFORTABLE_SPARE = 0.2


def grasp_prior(
    contacts: Contacts, engagement_m: np.ndarray, approach_up: np.ndarray, config: AntipodalConfig
) -> np.ndarray:
    """Rate grasps by geometry alone.

    A product, since one bad property spoils a grasp, of gentle factors, since each is a guess.
    Contact area weighs most: on meshes with known geometry it tells true antipodal contacts from
    corners and rims better than the normals do.

    Args:
        contacts: Contact patches of K grasps.
        engagement_m: (K,) how far the fingertips reach below the object's highest point.
        approach_up: (K,) vertical components of the approach directions; -1 is straight down.
        config: The sampler's settings.

    Returns:
        (K,) float32 in 0..1.
    """
    antipodal = contacts.alignment.min(axis=1).clip(0, 1) * (1 - contacts.opposition) / 2
    engagement = (engagement_m / _FULL_ENGAGEMENT_M).clip(0.1, 1) ** 0.35
    area = (contacts.area / _FULL_AREA).clip(0, 1) ** 0.5
    centring = np.exp(-((contacts.offset_m / _OFFSET_SCALE_M) ** 2) / 2)
    spare = 1 - contacts.width_m / config.gripper.max_width_m
    prior = antipodal * engagement * (0.4 + 0.6 * area) * (0.5 + 0.5 * centring)
    prior *= 0.75 + 0.25 * (spare / _COMFORTABLE_SPARE).clip(0, 1)
    prior *= 0.7 + 0.3 * (-approach_up).clip(0, 1)
    return prior.clip(0, 1).astype(np.float32)


def best_per_group(score: np.ndarray, group: np.ndarray, limit: int) -> np.ndarray:
    """Keep the best elements, fairly over groups.

    Args:
        score: (K,) larger is better.
        group: (K,) integers.
        limit: Most elements kept.

    Returns:
        Sorted indices: the best of every group, then the second best, until the limit.
    """
    order = np.argsort(-score, kind="stable")
    rank = _rank_in_group(group[order])
    fair = np.lexsort((np.arange(len(order)), rank))
    return np.sort(order[fair[:limit]])


def select_spread(
    Ts_world_tool: np.ndarray, prior: np.ndarray, config: AntipodalConfig
) -> np.ndarray:
    """Suppress near-duplicates and spread the rest over the table.

    Args:
        Ts_world_tool: (K, 4, 4) poses.
        prior: (K,) ratings.
        config: The sampler's settings.

    Returns:
        Indices of at most `max_candidates` grasps, best first.
    """
    order = np.argsort(-prior, kind="stable")
    order = order[_is_local_best(Ts_world_tool[order], config)]
    cells = voxel_keys(Ts_world_tool[order, :2, 3], config.cell_m)
    order = order[_rank_in_group(cells) < config.max_per_cell]
    cells = voxel_keys(Ts_world_tool[order, :2, 3], config.cell_m)
    return order[best_per_group(prior[order], cells, config.max_candidates)]


def _is_local_best(poses: np.ndarray, config: AntipodalConfig) -> np.ndarray:
    """Greedy suppression in SE(3), in rounds instead of one by one; poses come best first."""
    position, closing, approach = poses[:, :3, 3], poses[:, :3, 0], poses[:, :3, 2]
    cosine = np.cos(np.radians(config.nms_angle_deg))
    close = ((position[:, None] - position) ** 2).sum(axis=-1) < config.nms_distance_m**2
    # The gripper is symmetric: closing along x is closing along -x.
    close &= (approach @ approach.T > cosine) & (np.abs(closing @ closing.T) > cosine)
    better = np.tril(close, k=-1)
    kept = np.zeros(len(poses), bool)
    open_ = np.ones(len(poses), bool)
    while open_.any():
        winners = open_ & ~(better & open_).any(axis=1)
        kept |= winners
        open_ &= ~winners & ~(better & winners).any(axis=1)
    return kept


def _rank_in_group(group: np.ndarray) -> np.ndarray:
    """Position of every element among those of its group, in the given order."""
    order = np.argsort(group, kind="stable")
    starts = np.searchsorted(group[order], group[order], side="left")
    rank = np.empty(len(group), np.int64)
    rank[order] = np.arange(len(group)) - starts
    return rank
