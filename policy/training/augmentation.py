"""Changes of a decision that leave its labels true."""

import math
from dataclasses import dataclass, replace

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
    change = draw_channel_change(observation.feature_dim, config, rng)
    phrase, objects = observation.phrase_pooled, observation.objects
    changed = replace(
        observation,
        points=points @ T[:3, :3].T + T[:3, 3],
        features=change(observation.features[kept]),
        similarity=observation.similarity[kept],
        confidence=observation.confidence[kept],
        text_tokens=change(observation.text_tokens),
        text_pooled=change(observation.text_pooled),
        phrase_pooled=None if phrase is None else change(phrase),
        objects=None
        if objects is None
        else replace(objects.moved(T), features=change(objects.features)),
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


@dataclass(frozen=True, kw_only=True, eq=False)
class ChannelChange:
    """A change of feature channels, the same for points and texts.

    What happens to one side only would make their cosines meaningless.

    Attributes:
        order: (C,) which channel comes to stand where.
        factor: (C,) what it is multiplied with.
    """

    order: np.ndarray
    factor: np.ndarray

    def __call__(self, features: Float[np.ndarray, "*rows C"]) -> Float[np.ndarray, "*rows C"]:
        """Change features.

        Args:
            features: Of points, objects or texts.

        Returns:
            The changed ones.
        """
        return features[..., self.order] * self.factor


def draw_channel_change(
    num_channels: int, config: AugmentationConfig, rng: np.random.Generator
) -> ChannelChange:
    """Draw which channels are switched off, and whether channels change places and signs.

    Both keep products of two features, the first on average, the second exactly: exchanging
    channels and their signs is an orthogonal map.

    Args:
        num_channels: Number C of channels.
        config: `feature_dropout` and `channel_shuffle`.
        rng: Draws them; how often depends on the number of channels alone.

    Returns:
        The change.
    """
    is_on = rng.random(num_channels) >= config.feature_dropout
    factor = is_on / math.sqrt(1 - config.feature_dropout)
    is_shuffled = rng.random() < config.channel_shuffle
    order, signs = rng.permutation(num_channels), rng.choice([-1.0, 1.0], size=num_channels)
    if not is_shuffled:
        return ChannelChange(order=np.arange(num_channels), factor=factor)
    return ChannelChange(order=order, factor=factor * signs)
