"""CLIP-Grounding: find the object by the similarity of its box, then grasp it anyhow."""

import numpy as np
from jaxtyping import Float

from policy.actions import ActionCandidates
from policy.baselines.one_phase import OnePhasePolicy
from policy.observation import Observation
from policy.segments import means, owners, ranks, segment


class ClipGroundingPolicy(OnePhasePolicy):
    """Grasps the object whose box is most similar to the phrase, with a grasp drawn at random.

    The original compares CLIP's feature of the image inside each detected bounding box with the
    instruction, and draws one of the grasps that belong to the best box. Simplified here:

    - Boxes are those of the cloud's segments (`policy.segments`), in space instead of in
      an image. As in the original, a box holds whatever reaches into it.
    - The feature of a box is the normalised mean of the features of its points, not that of a
      separate crop; it is compared with the phrase that says what to pick.
    - A grasp belongs to the segment of the nearest point. If none on the best object can be
      carried out, the next most similar object follows.
    - The original only grasps. In the place phase, this is the policy `grounding`.
    """

    name = "clip-grounding"

    def _logits(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> Float[np.ndarray, " K"]:
        """Rank grasps by their object, and at random within an object.

        Returns:
            K logits: the rank of the object among all, 0 for the least similar, plus a fraction
            that `rng` draws for each grasp. Without points, the fraction alone.
        """
        draws = rng.permutation(len(candidates)) / max(len(candidates), 1)
        if not (observation.num_points and len(candidates)):
            return draws
        labels = segment(observation.points)
        similarity = _box_similarity(observation, labels)
        chosen = owners(observation.points, labels, candidates.positions)
        return ranks(similarity)[chosen] + draws


def _box_similarity(observation: Observation, labels: np.ndarray) -> Float[np.ndarray, " S"]:
    """Cosine of the phrase with the mean feature of what is in each segment's box."""
    points, features = observation.points, observation.features.astype(np.float64)
    phrase = observation.phrase_pooled
    phrase = observation.text_pooled if phrase is None else phrase
    is_small = np.isneginf(means(observation.similarity, labels))
    similarity = np.full(len(is_small), -np.inf)
    for label in np.flatnonzero(~is_small):
        mine = points[labels == label]
        is_inside = ((points >= mine.min(axis=0)) & (points <= mine.max(axis=0))).all(axis=1)
        mean = features[is_inside].mean(axis=0)
        similarity[label] = mean @ phrase / max(float(np.linalg.norm(mean)), 1e-9)
    return similarity
