"""After LERF-TOGO: relevancy at several scales, a mask of the object, grasps on it alone."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from policy.actions import ActionCandidates
from policy.baselines.one_phase import OnePhasePolicy
from policy.observation import Observation

_SCALES_M = (0.012, 0.02, 0.03, 0.04)
"""Radii over which features are pooled: from neighbouring voxels to a small object."""
# Pooled at the finest scale, points of one object are about this similar to its most relevant one.
_MIN_OBJECT_COSINE = 0.8
_NEIGHBOUR_M = 0.014
_CONTACT_M = 0.02
# The original's weights of semantics and geometry.
_SEMANTIC, _GEOMETRIC = 0.95, 0.05


class LerfTogoPolicy(OnePhasePolicy):
    """Grasps the object that is most relevant at the best scale; elsewhere nothing counts.

    The original fits a language-embedded radiance field to many views of a scene, asks it at many
    scales, keeps the scale with the highest relevancy, grows a mask of the object from the most
    relevant point by the similarity of DINO features, asks for the object's part inside this mask,
    and ranks grasps by 0.95 of their semantic and 0.05 of their geometric score. Simplified here:

    - No radiance field and no fitting: the features lifted from three views are pooled over
      neighbours within 12, 20, 30 and 40 mm.
    - The relevancy against the negative prompts is that of the observation's similarity. Pooled, it
      is the margin over the strongest negative of each point, which is exact where neighbours have
      the same strongest negative. If the similarity is a plain cosine, there are no negatives.
      Where the instruction names something else as well, the similarity is a product of two such
      answers (docs/perception.md), and the margin that of their product.
    - There are no DINO features: the mask grows over neighbouring points whose pooled features have
      a cosine of 0.8 or more with that of the most relevant point.
    - Instructions here name no parts: the part is the object. A grasp's semantic score is the mean
      relevancy within 20 mm, its geometric score the prior.
    - The original only grasps. In the place phase, this is the policy `grounding`.
    """

    name = "lerf-togo"

    def _logits(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> Float[np.ndarray, " K"]:
        """Rank grasps on the object by semantics and geometry, all others below them.

        Returns:
            K logits: 1 to 2 on the object, 0 to 1 elsewhere. Without points, the prior alone.
        """
        prior = candidates.prior.astype(np.float64)
        if not (observation.num_points and len(candidates)):
            return prior
        points = observation.points.astype(np.float64)
        tree = KDTree(points)
        relevancy = multi_scale_relevancy(observation, tree)
        on_object = grow_object(observation, tree, int(relevancy.argmax()))
        near = _neighbours(KDTree(candidates.positions), tree, _CONTACT_M)
        nearest = tree.query(candidates.positions)[1]
        counts = near.sum(axis=1)
        local = near @ relevancy / np.maximum(counts, 1)
        semantic = np.where(counts > 0, local, relevancy[nearest])
        spread = max(float(np.ptp(relevancy)), 1e-9)
        semantic = (semantic - relevancy.min()) / spread
        logits = _SEMANTIC * semantic + _GEOMETRIC * prior
        return logits + on_object[nearest]


def multi_scale_relevancy(observation: Observation, tree: KDTree) -> Float[np.ndarray, " N"]:
    """Relevancy of every point at the scale that has the highest one.

    Args:
        observation: The scene's feature cloud and the instruction, N at least 1.
        tree: Its points.

    Returns:
        (N,) margins of the pooled feature over the strongest negative, up to a common factor.
    """
    margin = observation.similarity.astype(np.float64)
    if margin.min() >= 0 and margin.max() <= 1:
        # The relevancy is the logistic function of the margin between two cosines.
        margin = np.clip(margin, 1e-6, 1 - 1e-6)
        margin = np.log(margin / (1 - margin))
    maps = []
    for radius_m in _SCALES_M:
        pool = _pooling(tree, radius_m)
        # Cosines are linear in features: the margin of a mean is the mean margin over its length.
        length = np.linalg.norm(pool @ observation.features, axis=1)
        maps.append(pool @ margin / np.maximum(length, 1e-6))
    return max(maps, key=np.max)


def grow_object(observation: Observation, tree: KDTree, seed: int) -> Bool[np.ndarray, " N"]:
    """Grow a mask from a point over neighbours of similar features.

    Args:
        observation: The scene's feature cloud.
        tree: Its points.
        seed: Index of the point.

    Returns:
        (N,) the mask, the point included.
    """
    pooled = _pooling(tree, _SCALES_M[0]) @ observation.features
    pooled /= np.maximum(np.linalg.norm(pooled, axis=1, keepdims=True), 1e-6)
    is_similar = pooled @ pooled[seed] >= _MIN_OBJECT_COSINE
    is_similar[seed] = True
    members = np.flatnonzero(is_similar)
    joined = _neighbours(KDTree(tree.data[members]), KDTree(tree.data[members]), _NEIGHBOUR_M)
    labels = connected_components(joined, directed=False)[1]
    mask = np.zeros(len(is_similar), dtype=bool)
    mask[members[labels == labels[np.searchsorted(members, seed)]]] = True
    return mask


def _pooling(tree: KDTree, radius_m: float) -> csr_array:
    """(N, N) matrix that averages over the neighbours of each point, itself included."""
    near = _neighbours(tree, tree, radius_m)
    return csr_array(near.multiply(1.0 / near.sum(axis=1)[:, None]))


def _neighbours(queries: KDTree, tree: KDTree, radius_m: float) -> csr_array:
    """(Q, N) matrix of ones where a point is within a radius of a query."""
    found = queries.query_ball_tree(tree, radius_m)
    counts = [len(indices) for indices in found]
    columns = np.fromiter((i for indices in found for i in indices), np.int64, sum(counts))
    starts = np.concatenate([[0], np.cumsum(counts)])
    return csr_array((np.ones(len(columns)), columns, starts), shape=(queries.n, tree.n))
