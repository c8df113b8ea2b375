"""Changes of a decision that leave its labels true."""

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from policy.actions import ActionCandidates
from policy.observation import Observation
from policy.training.config import AugmentationConfig


def augment(
    observation: Observation,
    candidates: ActionCandidates,
    config: AugmentationConfig,
    rng: np.random.Generator,
    *,
    max_points: int,
) -> tuple[Observation, ActionCandidates]:
    """Apply all changes; valid candidates stay valid, and the executed one stays the closest.

    Args:
        observation: What was seen and said.
        candidates: K candidates.
        config: Sizes of the changes.
        rng: Draws them; how often depends on the sizes of the arrays alone.
        max_points: Most points to keep.

    Returns:
        What might have been seen as well, and the candidates in their order.
    """
    kept = kept_points(observation.num_points, config.point_dropout, rng, max_points=max_points)
    points = observation.points[kept]
    points = points + rng.normal(scale=config.jitter_m, size=points.shape)
    angle = rng.uniform(-1, 1) * math.radians(config.rotation_deg)
    center = (observation.workspace_min + observation.workspace_max) / 2
    T = rotation_about_vertical(center, angle)
    gain = channel_gain(observation.feature_dim, config.feature_dropout, rng)
    phrase = observation.phrase_pooled
    changed = replace(
        observation,
        points=points @ T[:3, :3].T + T[:3, 3],
        features=observation.features[kept] * gain,
        similarity=observation.similarity[kept],
        confidence=observation.confidence[kept],
        text_tokens=observation.text_tokens * gain,
        text_pooled=observation.text_pooled * gain,
        phrase_pooled=None if phrase is None else phrase * gain,
        objects=None if observation.objects is None else observation.objects.moved(T, gain),
    )
    noise = rng.normal(scale=config.prior_noise, size=len(candidates))
    moved = replace(
        candidates,
        Ts_world_tool=T @ candidates.Ts_world_tool,
        prior=np.clip(candidates.prior + noise, 0.0, 1.0),
    )
    return changed, moved


def rotation_about_vertical(
    center: Float[np.ndarray, "3"], angle_rad: float
) -> Float[np.ndarray, "4 4"]:
    """Make the transform that turns the world about a vertical line.

    Args:
        center: A point of the line, metres.
        angle_rad: Angle, counter-clockwise seen from above.

    Returns:
        The transform; it leaves heights as they are.
    """
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    T = np.eye(4)
    T[:2, :2] = [[cos, -sin], [sin, cos]]
    T[:2, 3] = center[:2] - T[:2, :2] @ center[:2]
    return T


def kept_points(
    num_points: int, max_share: float, rng: np.random.Generator, *, max_points: int
) -> Int[np.ndarray, " M"]:
    """Choose points to keep, in their order.

    Args:
        num_points: Number of points.
        max_share: Largest share to leave out, unless `max_points` asks for more.
        rng: Draws the share, then the points.
        max_points: Most points to keep.

    Returns:
        Their indices, at least one if there are any points.
    """
    share = rng.uniform(0.0, max_share)
    num_kept = min(max_points, max(min(num_points, 1), round(num_points * (1 - share))))
    return np.sort(rng.permutation(num_points)[:num_kept])


def channel_gain(
    num_channels: int, share: float, rng: np.random.Generator
) -> Float[np.ndarray, " C"]:
    """Factors that switch channels off.

    The same for points and texts: a channel that only one side lacks would make their cosine
    meaningless.

    Args:
        num_channels: Number C of channels.
        share: Probability of each channel to be switched off.
        rng: Draws the channels.

    Returns:
        Zeros, and 1 / sqrt(1 - share) elsewhere, which keeps products on average.
    """
    is_on = rng.random(num_channels) >= share
    return is_on / math.sqrt(1 - share)
