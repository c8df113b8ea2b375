"""A policy without learning: act where the cloud looks most like the instruction."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from policy.actions import ActionCandidates, ActionScores
from policy.errors import InvalidConfigError
from policy.observation import Observation, PlaceSide

_POSITIVE = (
    "smoothing_radius_m", "pick_sigma_m", "place_sigma_m", "inside_sigma_m", "ring_m",
    "ring_sigma_m", "min_support",
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
    candidate; nearness to the most similar region and the geometric prior complete the score.

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
        points = observation.points.astype(np.float64)
        pairs = KDTree(points).query_pairs(self.config.smoothing_radius_m, output_type="ndarray")
        smoothed = self._smooth(observation, pairs)
        background = np.median(smoothed)
        if smoothed.max() - background < _MIN_CONTRAST:
            return np.zeros(len(candidates))
        region = self._most_similar_region(smoothed, pairs)
        if observation.side is not None:
            grown = self._grow(region, smoothed, pairs)
            return self._place_score(points[grown, :2], observation.side, candidates)
        contrast = smoothed[region].mean() - background
        relevance = np.clip((smoothed - background) / contrast, -1.0, 1.0)

        offsets = candidates.positions[:, None] - points[None]
        sigma_m = self.config.pick_sigma_m
        if candidates.kind == "place":
            # The tool's height over the support depends on the object it holds; only the place on
            # the ground plan counts.
            offsets, sigma_m = offsets[..., :2], self.config.place_sigma_m
        squared = (offsets**2).sum(axis=-1)
        kernel = np.exp(-squared / (2 * sigma_m**2)) * observation.confidence
        local = (kernel @ relevance) / (kernel.sum(axis=1) + self.config.min_support)
        nearness = np.exp(-squared[:, region].min(axis=1) / (2 * sigma_m**2))
        weight = self.config.region_weight
        return weight * nearness + (1 - weight) * local

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

    def _smooth(
        self, observation: Observation, pairs: Int[np.ndarray, "M 2"]
    ) -> Float[np.ndarray, " N"]:
        """Average the similarity over neighbours, weighted by confidence and distance."""
        points = observation.points.astype(np.float64)
        distance = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        # Half the radius as sigma: neighbours at the rim weigh 0.14.
        kernel = np.exp(-2 * (distance / self.config.smoothing_radius_m) ** 2)
        # Points without confidence still need a value; a trace of weight gives them one.
        weight = observation.confidence.astype(np.float64) + 1e-6
        total, mass = weight * observation.similarity, weight.copy()
        for here, there in (pairs.T, pairs.T[::-1]):
            num_points = len(points)
            neighbour = kernel * weight[there]
            mass += np.bincount(here, neighbour, num_points)
            total += np.bincount(here, neighbour * observation.similarity[there], num_points)
        return total / mass

    def _most_similar_region(
        self, smoothed: Float[np.ndarray, " N"], pairs: Int[np.ndarray, "M 2"]
    ) -> Int[np.ndarray, " R"]:
        """Indices of the connected set of similar points with the most similarity in total."""
        excess = smoothed - _threshold(smoothed, self.config.region_level)
        is_high = excess >= 0
        labels = _connected(is_high, pairs)
        # Size and strength together: a lone outlier has no size, a broad faint area no excess.
        mass = np.bincount(labels[is_high], excess[is_high], len(smoothed))
        return np.flatnonzero(is_high & (labels == mass.argmax()))

    def _grow(
        self,
        region: Int[np.ndarray, " R"],
        smoothed: Float[np.ndarray, " N"],
        pairs: Int[np.ndarray, "M 2"],
    ) -> Int[np.ndarray, " G"]:
        """Add the connected points of lesser similarity to a region."""
        is_high = smoothed >= _threshold(smoothed, self.config.grow_level)
        is_high[region] = True
        labels = _connected(is_high, pairs)
        return np.flatnonzero(is_high & (labels == labels[region[0]]))


def _threshold(smoothed: Float[np.ndarray, " N"], level: float) -> float:
    """Return the similarity at a share of the way from the median point to the best."""
    background = float(np.median(smoothed))
    return background + level * (float(smoothed.max()) - background)


def _connected(
    is_high: Bool[np.ndarray, " N"], pairs: Int[np.ndarray, "M 2"]
) -> Int[np.ndarray, " N"]:
    """Label the connected sets of the points that count; pairs are neighbours."""
    edges = pairs[is_high[pairs].all(axis=1)]
    graph = coo_array(
        (np.ones(len(edges), dtype=bool), (edges[:, 0], edges[:, 1])),
        shape=(len(is_high), len(is_high)),
    )
    return connected_components(graph, directed=False)[1]
