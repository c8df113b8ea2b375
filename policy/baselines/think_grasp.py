"""After ThinkGrasp: ground the target, and take what lies on it away first. A rule decides."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull, KDTree, QhullError

from policy.actions import ActionCandidates
from policy.baselines.one_phase import OnePhasePolicy
from policy.observation import Observation
from policy.segments import means, owners, segment

# What is higher than the target's nearest point by more than a voxel lies above it.
_CLEARANCE_M = 0.01
# Less is a corner that reaches over the edge: 6 voxels of 8 mm are 4 square centimetres.
_MIN_COVERING = 6
# Gap between classes of candidates; what decides within a class lies in 0..1.
_CLASS = 2.0


class ThinkGraspPolicy(OnePhasePolicy):
    """Grasps the target, or the highest object that lies on it as long as there is one.

    The original shows the scene to a vision-language model (GPT-4o), which names the object to
    grasp and, in heavy clutter, what to move away first; a segmentation model (LangSAM) crops that
    object, and the best grasp of a grasp network in the crop is executed. Simplified here:

    - No language-model service. The target is the segment of the cloud with the highest mean
      similarity to the phrase. What lies on it is found by a rule: at least 6 points of another
      segment, inside the outline of the target seen from above (its convex hull), each more than
      10 mm higher than the nearest point of the target. The one with the highest top goes first.
    - Segments (`policy.segments`) stand for LangSAM's crop, and the candidates' prior
      for the score of the grasp network. The model's choice of a part of the object is left out.
    - Nothing is remembered from one attempt to the next, as in the original.
    - The original only grasps. In the place phase, this is the policy `grounding`.
    """

    name = "think-grasp"

    def _logits(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> Float[np.ndarray, " K"]:
        """Rank grasps: the occluder, then the target, then everything else by similarity.

        Returns:
            K logits; within the occluder and the target, the prior decides. Without points, it
            decides alone.
        """
        logits = candidates.prior.astype(np.float64)
        if not (observation.num_points and len(candidates)):
            return logits
        points = observation.points.astype(np.float64)
        labels = segment(points)
        similarity = means(observation.similarity, labels)
        target = int(similarity.argmax())
        occluder = find_occluder(points, labels, target)
        mine = owners(points, labels, candidates.positions)
        is_other = (mine != target) & (mine != occluder)
        floor = observation.similarity.min()
        logits[is_other] = np.maximum(similarity[mine[is_other]], floor) - similarity[target]
        logits[mine == target] += _CLASS
        if occluder != target:
            logits[mine == occluder] += 2 * _CLASS
        return logits


def find_occluder(
    points: Float[np.ndarray, "N 3"], labels: Int[np.ndarray, " N"], target: int
) -> int:
    """Find what lies on a segment.

    Args:
        points: (N, 3) the cloud, metres.
        labels: (N,) its segments.
        target: Label of the segment in question.

    Returns:
        Label of the highest of the segments that lie on it; the target's own if none does.
    """
    mine, others = points[labels == target], np.flatnonzero(labels != target)
    if not len(others):
        return target
    others = others[_inside_outline(mine[:, :2], points[others, :2])]
    nearest = KDTree(mine[:, :2]).query(points[others, :2])[1]
    covering = others[points[others, 2] > mine[nearest, 2] + _CLEARANCE_M]
    counts = np.bincount(labels[covering], minlength=int(labels.max()) + 1)
    found = np.flatnonzero(counts >= _MIN_COVERING)
    if not len(found):
        return target
    tops = [points[labels == label, 2].max() for label in found]
    return int(found[np.argmax(tops)])


def _inside_outline(
    outline: Float[np.ndarray, "M 2"], positions: Float[np.ndarray, "P 2"]
) -> Bool[np.ndarray, " P"]:
    """Tell which positions lie in the convex hull of others; all outside if it has no area."""
    try:
        sides = ConvexHull(outline).equations
    except (QhullError, ValueError):
        return np.zeros(len(positions), dtype=bool)
    return np.all(positions @ sides[:, :2].T + sides[:, 2] <= 0, axis=1)
