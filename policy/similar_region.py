"""The region of a cloud that is most similar to what is looked for."""

from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree


class SmoothedSimilarity:
    """Similarity averaged over neighbours, weighted by confidence and distance.

    Args:
        points: (N, 3) positions, metres; at least one.
        similarity: (N,) similarity of each.
        confidence: (N,) weight of each, 0 or more.
        radius_m: Neighbours within this distance are averaged, and connect regions.
        pairs: (M, 2) indices of all points within that distance of each other, if they are known
            from another question about the same points.
    """

    def __init__(
        self,
        points: Float[np.ndarray, "N 3"],
        similarity: Float[np.ndarray, " N"],
        confidence: Float[np.ndarray, " N"],
        radius_m: float,
        pairs: Int[np.ndarray, "M 2"] | None = None,
    ) -> None:
        """Average the similarity."""
        points = points.astype(np.float64)
        self.pairs = neighbour_pairs(points, radius_m) if pairs is None else pairs
        distance = np.linalg.norm(points[self.pairs[:, 0]] - points[self.pairs[:, 1]], axis=1)
        # Half the radius as sigma: neighbours at the rim weigh 0.14.
        kernel = np.exp(-2 * (distance / radius_m) ** 2)
        # Points without confidence still need a value; a trace of weight gives them one.
        weight = confidence.astype(np.float64) + 1e-6
        total, mass = weight * similarity, weight.copy()
        for here, there in (self.pairs.T, self.pairs.T[::-1]):
            neighbour = kernel * weight[there]
            mass += np.bincount(here, neighbour, len(points))
            total += np.bincount(here, neighbour * similarity[there], len(points))
        self.values: Float[np.ndarray, " N"] = total / mass

    @cached_property
    def background(self) -> float:
        """The median: most of a cloud is not what is looked for."""
        return float(np.median(self.values))

    def best_region(self, level: float) -> Int[np.ndarray, " R"]:
        """Find the connected set of similar points with the most similarity in total.

        Args:
            level: How similar its points are at least: the share of the way from the background to
                the best point, 0 to 1.

        Returns:
            Indices of its points.
        """
        excess = self.values - self._threshold(level)
        is_high = excess >= 0
        labels = self._connected(is_high)
        # Size and strength together: a lone outlier has no size, a broad faint area no excess.
        mass = np.bincount(labels[is_high], excess[is_high], len(self.values))
        return np.flatnonzero(is_high & (labels == mass.argmax()))

    def grow(self, region: Int[np.ndarray, " R"], level: float) -> Int[np.ndarray, " G"]:
        """Add the connected points of lesser similarity to a region.

        Args:
            region: Indices of its points, at least one.
            level: As for `best_region`.

        Returns:
            Indices of all points.
        """
        is_high = self.values >= self._threshold(level)
        is_high[region] = True
        labels = self._connected(is_high)
        return np.flatnonzero(is_high & (labels == labels[region[0]]))

    def _threshold(self, level: float) -> float:
        return self.background + level * (float(self.values.max()) - self.background)

    def _connected(self, is_high: Bool[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """Label the connected sets of the points that count."""
        edges = self.pairs[is_high[self.pairs].all(axis=1)]
        graph = coo_array(
            (np.ones(len(edges), dtype=bool), (edges[:, 0], edges[:, 1])),
            shape=(len(is_high), len(is_high)),
        )
        return connected_components(graph, directed=False)[1]


def neighbour_pairs(points: Float[np.ndarray, "N 3"], radius_m: float) -> Int[np.ndarray, "M 2"]:
    """Find all points within a distance of each other.

    Args:
        points: (N, 3) positions, metres.
        radius_m: The distance.

    Returns:
        (M, 2) pairs of indices, each once.
    """
    return KDTree(points).query_pairs(radius_m, output_type="ndarray")
