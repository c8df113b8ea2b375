"""A policy without learning: act where the cloud looks most like the instruction."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from policy.actions import ActionCandidates, ActionScores
from policy.errors import InvalidConfigError
from policy.observation import Observation, PlaceSide
from policy.similar_region import SmoothedSimilarity

_POSITIVE = (
    "smoothing_radius_m", "pick_sigma_m", "place_sigma_m", "inside_sigma_m", "ring_m",
    "ring_sigma_m", "min_support", "blocked_m", "clearing_scale_m",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class GroundingConfig:
    """Parameters of `GroundingPolicy`, with the reason for each value.

    Attributes:
        smoothing_radius_m: Neighbours within this distance are averaged. A feature point stands
            for 5-10 mm and a single one is noisy; 25 mm is about ten to forty surface points,
            yet less than most objects.
        region_level: The most similar region holds the points whose smoothed similarity reaches
            this share of the way from the median to the maximum. Half would join neighbours of
            similar meaning; 0.9 would leave fragments of one object.
        pick_sigma_m: Width of the kernel around a grasp's contact point: the half-width of a
            22 mm finger pad, plus the few millimetres that the cloud is off.
        place_sigma_m: Width of the kernel for placing where the relation is not known. A place
            pose stands over a region or beside it (rings around a reference start 50 mm from its
            edge), so it's wider.
        grow_level: Where the relation is known, the region is grown to connected points that reach
            this share, so that it covers the reference and has its edge and middle.
        inside_sigma_m: Distance from the reference's middle, seen from above, at which a place
            inside loses 0.4 of its score.
        ring_m: Best distance from the reference's edge for a place around it: the middle of the
            protocol's ring of 0.05 to 0.15 m.
        ring_sigma_m: Deviation from that at which such a place loses 0.4 of its score.
        min_support: Kernel mass, in points of full confidence at the contact, at which a
            candidate's local evidence counts half. Keeps one stray point from deciding.
        region_weight: Share of nearness to the region in the score; the rest is the local mean
            similarity. The first finds the object, the second centres the grasp on it.
        blocked_m: If no grasp is this near to the region, it is taken to be blocked: more than the
            half-width of a finger pad and the errors of cloud and region together. Of 501 choices
            of demonstrations, 101 of which clear the way, 0.01 to 0.025 did best. Of 264 that
            clear the way, this rule makes 52 % right instead of 30, of 400 others 97.5 instead
            of 97.8.
        clearing_scale_m: Distance over which the bonus of grasps near a blocked region falls to
            0.37: the size of an object.
        temperature: Difference in score (0 background, 1 target) worth one unit of logit.
        prior_exponent: Weight of log prior. At these values a prior three times better is worth
            0.05 of score: it decides between grasps of one object, never between objects.

    Raises:
        InvalidConfigError: If a value is out of range.
    """

    smoothing_radius_m: float = 0.025
    region_level: float = 0.7
    pick_sigma_m: float = 0.015
    place_sigma_m: float = 0.05
    grow_level: float = 0.35
    inside_sigma_m: float = 0.02
    ring_m: float = 0.10
    ring_sigma_m: float = 0.025
    min_support: float = 2.0
    region_weight: float = 0.5
    blocked_m: float = 0.025
    clearing_scale_m: float = 0.05
    temperature: float = 0.1
    prior_exponent: float = 0.5

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in _POSITIVE:
            self._check(name, getattr(self, name) > 0, "a value above 0")
        self._check("temperature", self.temperature > 0, "a value above 0")
        for name in ("region_level", "grow_level"):
            self._check(name, 0 < getattr(self, name) < 1, "a value between 0 and 1")
        self._check("region_weight", 0 <= self.region_weight <= 1, "0 to 1")
        self._check("prior_exponent", self.prior_exponent >= 0, "at least 0")

    def _check(self, name: str, is_valid: bool, expected: str) -> None:
        if not is_valid:
            raise InvalidConfigError(f"{name}: got {getattr(self, name):g}, expected {expected}.")


# A prior of 0 must not give a logit of minus infinity.
_MIN_PRIOR = 1e-3
# Below this, differences of similarity are rounding, and the cloud says nothing.
_MIN_CONTRAST = 1e-5


class GroundingPolicy:
    """Scores each candidate by how similar to the instruction the cloud is at its contact.

    The similarity is averaged over neighbours, expressed as contrast against the rest of the
    cloud (0 for the median point, 1 for the most similar region), and gathered around every
    candidate; nearness to the most similar region and the geometric prior complete the score. If
    nothing can be gripped at that region, the grasps nearest to it win: what they take away is
    probably in the way.

    For a place action the similarity is that to the reference: places over the middle of the most
    similar region win where the relation asks for one inside, places at a distance from its edge
    where it asks for one around. Without a known relation, places over or beside it win alike.
    """

    name = "grounding"

    def __init__(self, config: GroundingConfig | None = None) -> None:
        """Make the policy.

        Args:
            config: Parameters; None for the defaults.
        """
        self.config = config or GroundingConfig()

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Score every candidate by similarity; nothing is drawn from `rng`.

        Args:
            observation: The scene's feature cloud and the instruction.
            candidates: K candidates; K may be 0.
            rng: Not used.

        Returns:
            K logits. Without points, or with a similarity that is the same everywhere, the prior
            alone decides.
        """
        del rng
        config = self.config
        logits = config.prior_exponent * np.log(np.maximum(candidates.prior, _MIN_PRIOR))
        if observation.num_points and len(candidates):
            logits = logits + self._semantic_score(observation, candidates) / config.temperature
        return ActionScores(logits=logits)

    def _semantic_score(
        self, observation: Observation, candidates: ActionCandidates
    ) -> Float[np.ndarray, " K"]:
        points, config = observation.points.astype(np.float64), self.config
        similarity = SmoothedSimilarity(
            points, observation.similarity, observation.confidence, config.smoothing_radius_m
        )
        smoothed, background = similarity.values, similarity.background
        if smoothed.max() - background < _MIN_CONTRAST:
            return np.zeros(len(candidates))
        region = similarity.best_region(config.region_level)
        if observation.side is not None:
            grown = similarity.grow(region, config.grow_level)
            return self._place_score(points[grown, :2], observation.side, candidates)
        contrast = smoothed[region].mean() - background
        relevance = np.clip((smoothed - background) / contrast, -1.0, 1.0)

        offsets = candidates.positions[:, None] - points[None]
        sigma_m = config.pick_sigma_m
        if candidates.kind == "place":
            # The tool's height over the support depends on the object it holds; only the place on
            # the ground plan counts.
            offsets, sigma_m = offsets[..., :2], config.place_sigma_m
        squared = (offsets**2).sum(axis=-1)
        kernel = np.exp(-squared / (2 * sigma_m**2)) * observation.confidence
        local = (kernel @ relevance) / (kernel.sum(axis=1) + config.min_support)
        squared_to_region = squared[:, region].min(axis=1)
        nearness = np.exp(-squared_to_region / (2 * sigma_m**2))
        weight = config.region_weight
        score = weight * nearness + (1 - weight) * local
        distance_m = np.sqrt(squared_to_region)
        if candidates.kind == "pick" and distance_m.min() > config.blocked_m:
            # Nothing can be gripped there; what is nearest is probably in the way.
            score = score + np.exp(-distance_m / config.clearing_scale_m)
        return score

    def _place_score(
        self,
        reference: Float[np.ndarray, "R 2"],
        side: PlaceSide,
        candidates: ActionCandidates,
    ) -> Float[np.ndarray, " K"]:
        """Score places by where they lie relative to a reference, seen from above."""
        positions, config = candidates.positions[:, :2], self.config
        if side == "inside":
            middle = (reference.min(axis=0) + reference.max(axis=0)) / 2
            deviation = np.linalg.norm(positions - middle, axis=1) / config.inside_sigma_m
        else:
            distance = KDTree(reference).query(positions)[0]
            deviation = (distance - config.ring_m) / config.ring_sigma_m
        return np.exp(-(deviation**2) / 2)
