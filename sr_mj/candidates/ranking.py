"""The geometric prior of a grasp, and the choice of a few well-spread ones."""

import numpy as np

from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.contacts import Contacts
from sr_mj.candidates.surface import voxel_keys

# Odds that both contacts are truly antipodal: a logistic fit to 5000 grasps in 28 simulated heaps
# of which the meshes were known (cross-validated over heaps, area under the ROC curve 0.84).
_ODDS = 55.0
_WORSE_POWER, _BETTER_POWER, _AREA_POWER = 7.0, 6.0, 1.8
_FULL_AREA = 0.4
# Deeper engagement than most of a pad's height gains nothing.
_FULL_ENGAGEMENT_M = 0.03
_OFFSET_SCALE_M = 0.04
# Room beside the object, on each side, from which on an approach is not touch and go: the noise of
# the cloud and of the arm. Without any, the prior is half.
_FULL_ROOM_M = 0.004
# Log-odds that the fingers close on two objects: a logistic fit to 5800 grasps in 40 simulated
# heaps, of which 350 did (area under the ROC curve 0.88). A valley between the contacts tells, and
# so does a difference in colour; the deepest valleys are often the inside of a cup.
_PAIR_ODDS, _PAIR_GAP, _PAIR_GAP_CUBED, _PAIR_CONTRAST = -4.39, 5.57, -3.87, 7.34
_LARGEST_CONTRAST = 0.4


def chance_of_two(contacts: Contacts) -> np.ndarray:
    """Estimate the probability that two objects are between the fingers, not one.

    Args:
        contacts: Contact patches of K grasps.

    Returns:
        (K,) probabilities.
    """
    logit = _PAIR_ODDS + _PAIR_GAP * contacts.gap + _PAIR_GAP_CUBED * contacts.gap**3
    logit += _PAIR_CONTRAST * np.minimum(contacts.contrast, _LARGEST_CONTRAST)
    return 1 / (1 + np.exp(-logit))


def grasp_prior(
    contacts: Contacts, engagement_m: np.ndarray, approach_up: np.ndarray, max_width_m: float
) -> np.ndarray:
    """Rate grasps by geometry alone.

    The probability that the contacts are antipodal and belong to one object, given how they look,
    times gentle factors for what makes such a grasp hold: fingertips deep beside the object, close
    to its local centre, coming from above, with room between object and open fingers.

    Args:
        contacts: Contact patches of K grasps.
        engagement_m: (K,) how far the fingertips reach below the object's highest point.
        approach_up: (K,) vertical components of the approach directions; -1 is straight down.
        max_width_m: Stroke of the gripper.

    Returns:
        (K,) float32 in 0..1.
    """
    alignment = np.sort(contacts.alignment.clip(0, 1), axis=1)
    odds = _ODDS * alignment[:, 0] ** _WORSE_POWER * alignment[:, 1] ** _BETTER_POWER
    odds *= (contacts.area / _FULL_AREA).clip(0, 1) ** _AREA_POWER
    prior = odds / (1 + odds)
    prior *= (engagement_m / _FULL_ENGAGEMENT_M).clip(0, 1) ** 0.25
    prior *= 0.5 + 0.5 * np.exp(-((contacts.offset_m / _OFFSET_SCALE_M) ** 2) / 2)
    prior *= 0.7 + 0.3 * (-approach_up).clip(0, 1)
    room_m = (max_width_m - contacts.width_m) / 2
    prior *= 0.5 + 0.5 * (room_m / _FULL_ROOM_M).clip(0, 1)
    prior *= 1 - chance_of_two(contacts)
    return prior.astype(np.float32)


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
