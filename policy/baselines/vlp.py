"""After VLP: the highest place that satisfies reference and relation."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from policy.actions import ActionCandidates
from policy.baselines.one_phase import OnePhasePolicy
from policy.observation import Observation, PlaceSide
from policy.segments import means, segment

# The protocol's ring around a reference, from its edge.
_RING_M = (0.05, 0.15)
# Half of the middle third of a reference, at least: a voxel and the spacing of candidates.
_MIN_INSIDE_M = 0.02
# Candidates on one support differ by the noise of the cloud; among them the prior decides.
_LEVEL_M = 0.005


class VlpPolicy(OnePhasePolicy):
    """Places at the highest spot over the middle of the reference, or in the ring around it.

    The original grounds the reference by CLIP on object boxes and goes to the highest point that
    satisfies reference and relation, whatever else is there. Simplified here:

    - The reference is the segment of the cloud (`policy.segments`) with the highest mean
      similarity to the phrase that names it.
    - The point is chosen among the place candidates, all with the same object in the gripper:
      inside means over the middle third of the reference's box, outside 0.05 to 0.15 m from its
      edge, seen from above. Candidates are stable one by one, which the original's points need not
      be. In the ring, the highest of them may be on top of something else, as in the original.
    - Where the relation is not known, either will do.
    - If no candidate satisfies the relation, the nearest to doing so follows.
    - The original only places. In the pick phase, this is the policy `grounding`.
    """

    name = "vlp"
    phase = "place"

    def _logits(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> Float[np.ndarray, " K"]:
        """Rank places by relation first, then by height, then by the prior.

        Returns:
            K logits: for places that satisfy the relation their level, in steps of 5 mm from the
            lowest candidate, plus half of the prior; for others minus their distance from
            satisfying it, in metres. Without points, the prior alone.
        """
        prior = candidates.prior.astype(np.float64)
        if not (observation.num_points and len(candidates)):
            return prior
        labels = segment(observation.points)
        similarity = means(observation.similarity, labels)
        reference = observation.points[labels == similarity.argmax(), :2].astype(np.float64)
        missing_m = distance_to_relation(reference, candidates.positions[:, :2], observation.side)
        heights = candidates.positions[:, 2]
        levels = np.round((heights - heights.min()) / _LEVEL_M)
        # Half of the prior: a level above always wins.
        return np.where(missing_m > 0, -missing_m, levels + prior / 2)


def distance_to_relation(
    reference: Float[np.ndarray, "R 2"], places: Float[np.ndarray, "K 2"], side: PlaceSide | None
) -> Float[np.ndarray, " K"]:
    """Measure how far places are from satisfying a relation, seen from above.

    Args:
        reference: (R, 2) points of the reference, metres.
        places: (K, 2) places, metres.
        side: Inside or outside; None for either.

    Returns:
        (K,) metres; 0 for those that satisfy it.
    """
    low, high = reference.min(axis=0), reference.max(axis=0)
    half = np.maximum((high - low) / 6, _MIN_INSIDE_M)
    beyond = np.maximum(np.abs(places - (low + high) / 2) - half, 0.0)
    inside = np.linalg.norm(beyond, axis=1)
    edge = KDTree(reference).query(places)[0]
    outside = np.maximum(np.maximum(_RING_M[0] - edge, edge - _RING_M[1]), 0.0)
    if side is None:
        return np.minimum(inside, outside)
    return inside if side == "inside" else outside
