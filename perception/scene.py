"""A lifted scene that can be asked questions, and the answers."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from perception.cloud import FeatureCloud, GeometryCloud
from perception.errors import InvalidCloudError
from perception.language import Instruction, parse_instruction
from perception.text_scores import TextScorer, check_length

# A region reaches down to half way between the median and the best similarity.
_REGION_SHARE = 0.5
_REGION_STEP = 2.5  # in spacings of the cloud


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """Where a text fits a scene.

    Attributes:
        instruction: The text, taken apart.
        phrase: The part of it that was looked for.
        cloud: The scene's cloud with the similarity to the phrase.
        best: Index of the most similar point.
        region: (M,) indices of the connected points around it that are about as similar.
        reference: The answer for the object to place by, if the text names one besides the target.
    """

    instruction: Instruction
    phrase: str
    cloud: FeatureCloud
    best: int
    region: np.ndarray
    reference: "Answer | None" = None

    @property
    def point(self) -> np.ndarray:
        """(3,) float32: the most similar point, world, metres."""
        return self.cloud.points[self.best]

    @property
    def score(self) -> float:
        """The similarity of the most similar point."""
        return float(self.cloud.similarity[self.best])

    @property
    def center(self) -> np.ndarray:
        """(3,) float32: middle of the region's bounding box, world, metres."""
        points = self.cloud.points[self.region]
        return (points.min(axis=0) + points.max(axis=0)) / 2

    @property
    def size_m(self) -> np.ndarray:
        """(3,) float32: edges of the region's bounding box, metres."""
        return np.ptp(self.cloud.points[self.region], axis=0)


@dataclass(frozen=True, kw_only=True, eq=False)
class LiftedScene:
    """A cloud with features, and the text tower that it can be compared with.

    Attributes:
        cloud: Points with features; their similarity is 0.
        scorer: Compares features with texts; remembers those it has seen.
        geometry: The finer cloud that the points were thinned out from; None if it was not kept.
    """

    cloud: FeatureCloud
    scorer: TextScorer
    geometry: GeometryCloud | None = None

    def __post_init__(self) -> None:
        """Check that cloud and text tower share a space."""
        encoder, made_by = self.scorer.encoder, self.cloud.encoder
        dim = self.cloud.features.shape[1]
        if dim != encoder.feature_dim or made_by not in ("", encoder.name):
            raise InvalidCloudError(
                f"The cloud has {dim} channels of encoder {made_by or 'unknown'!r}, but encoder "
                f"{encoder.name!r} has {encoder.feature_dim}; load the encoder that made the cloud."
            )

    @classmethod
    def load(cls, path: Path | str, scorer: TextScorer) -> "LiftedScene":
        """Read a cloud from a file and make it answer questions again.

        Args:
            path: A file that `FeatureCloud.save` wrote as .npz.
            scorer: Text tower of the encoder that made its features.

        Returns:
            The scene, without the fine geometry.

        Raises:
            MissingFileError: If there is no such file.
            InvalidFileError: If it holds no cloud.
            InvalidCloudError: If another encoder made it.
        """
        cloud = FeatureCloud.load(path)
        return cls(cloud=replace(cloud, similarity=np.zeros_like(cloud.similarity)), scorer=scorer)

    def save(self, path: Path | str) -> None:
        """Write the cloud with its features; see `FeatureCloud.save`.

        Args:
            path: File to write, .npz or .ply.

        Raises:
            InvalidFileError: If the suffix is another one, or the file cannot be written.
        """
        self.cloud.save(path)

    def similarity(self, text: str) -> np.ndarray:
        """Compare every point with a text, taken as it is.

        Args:
            text: What is looked for, such as "red mug".

        Returns:
            (N,) float32: 0..1, where 0.5 is as good a fit as the best negative prompt.

        Raises:
            InvalidTextError: If the text is empty or too long.
        """
        return self.scorer.score(self.cloud.features, text)

    def query(self, text: str) -> Answer:
        """Find what a text asks for. Only the text tower runs: images were encoded before.

        Args:
            text: A phrase ("red mug") or an instruction ("put the mug next to the box").

        Returns:
            Where it is, and where the reference is if the text names one besides the target.

        Raises:
            InvalidTextError: If the text is empty or too long.
        """
        instruction = parse_instruction(text)
        check_length(text)  # the whole text must be usable, not only its parts
        answer = self._find(instruction, instruction.target_phrase, instruction.unwanted)
        if instruction.target is not None and instruction.reference is not None:
            answer = replace(answer, reference=self._find(instruction, instruction.reference))
        return answer

    def _find(
        self, instruction: Instruction, phrase: str, unwanted: tuple[str, ...] = ()
    ) -> Answer:
        similarity = self.scorer.score(self.cloud.features, phrase, unwanted)
        cloud = replace(self.cloud, similarity=similarity)
        best = int(np.argmax(cloud.similarity))
        region = grow_region(cloud.points, cloud.similarity, best)
        return Answer(instruction=instruction, phrase=phrase, cloud=cloud, best=best, region=region)


def grow_region(points: np.ndarray, similarity: np.ndarray, seed: int) -> np.ndarray:
    """Find the connected points around one that are about as similar.

    Args:
        points: (N, 3) coordinates, metres.
        similarity: (N,) similarities.
        seed: Index of the point to start from.

    Returns:
        (M,) indices in rising order, `seed` among them.
    """
    low = np.median(similarity)
    threshold = low + _REGION_SHARE * (similarity[seed] - low)
    chosen = np.flatnonzero(similarity >= threshold)
    if len(chosen) == 1:
        return chosen
    tree = KDTree(points)
    spacing = float(np.median(tree.query(points[chosen], k=2)[0][:, 1]))
    near = KDTree(points[chosen]).sparse_distance_matrix(
        KDTree(points[chosen]), _REGION_STEP * spacing, output_type="coo_matrix"
    )
    _, labels = connected_components(near, directed=False)
    return chosen[labels == labels[np.searchsorted(chosen, seed)]]
