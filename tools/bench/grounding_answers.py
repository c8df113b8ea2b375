"""Answers of an encoder to questions about a scene, marked right or wrong."""

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree
from torch import Tensor

from perception.cloud import FeatureCloud
from perception.encoders import load_encoder
from perception.encoders.base import Encoder, TextFeatures
from perception.language import parse_instruction
from perception.text_scores import TextScorer
from policy.grounding import GroundingConfig
from policy.similar_region import SmoothedSimilarity, neighbour_pairs
from tools.bench.grounding_scenes import BenchScene, Question, list_questions

# Objects that fewer feature points lie on are hardly in sight: 10 voxels of 8 mm are 6 square
# centimetres, a third of a marker pen.
MIN_POINTS = 10
UNTRAINED = "embedded:untrained"


def open_encoder(name: str) -> Encoder:
    """Load an encoder by name.

    Args:
        name: As `perception.encoders.load_encoder` knows it, or "embedded:untrained", the
            mixture of class names that the training started from.

    Returns:
        The encoder, which remembers the texts it has encoded.
    """
    if name != UNTRAINED:
        return RememberingEncoder(load_encoder(name))
    from perception.encoders.embedded import EmbeddedEncoder, EmbeddedEncoderConfig

    config = EmbeddedEncoderConfig(mixture_share=1.0)
    return RememberingEncoder(EmbeddedEncoder(config))


class RememberingEncoder:
    """An encoder that encodes no text twice: the same questions return in scene after scene."""

    def __init__(self, encoder: Encoder) -> None:
        """Wrap an encoder."""
        self._encoder = encoder
        self.name, self.fingerprint = encoder.name, encoder.fingerprint
        self.fingerprints, self.feature_dim = encoder.fingerprints, encoder.feature_dim
        self._remembered = functools.cache(encoder.encode_text)

    def encode_dense(self, images: Sequence[np.ndarray]) -> Tensor:
        """Encode images; see `Encoder.encode_dense`."""
        return self._encoder.encode_dense(images)

    def encode_text(self, text: str) -> TextFeatures:
        """Encode a text, or return its features again."""
        return self._remembered(text)


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Whether an answer is right, by three measures.

    Attributes:
        point: The most similar feature point lies on a target.
        region: So does the middle of the most similar region, as the grounding policy finds it in
            the smoothed similarity.
        object: The visible object with the highest mean similarity is a target.
    """

    point: bool
    region: bool
    object: bool


class Examiner:
    """Asks about one lifted scene, and marks the answers."""

    def __init__(self, bench: BenchScene, cloud: FeatureCloud, scorer: TextScorer) -> None:
        """Find out which point lies on which object.

        Args:
            bench: The scene.
            cloud: Its points with features.
            scorer: Text tower of the encoder that made them.
        """
        self._bench, self._cloud, self._scorer = bench, cloud, scorer
        self.owners = bench.owners(cloud.points)
        self._counts = np.bincount(self.owners[self.owners >= 0], minlength=len(bench.words))
        self.visible = np.flatnonzero(self._counts >= MIN_POINTS)
        self._tree = KDTree(cloud.points)
        self._config = GroundingConfig()
        self._pairs = neighbour_pairs(cloud.points, self._config.smoothing_radius_m)
        self._answers: dict[str, tuple[int, int, int]] = {}

    def questions(self) -> list[Question]:
        """List the questions that the scene allows."""
        return list_questions(self._bench, self.visible)

    def ask(self, text: str) -> tuple[int, int, int]:
        """Ask for something, as an episode would.

        Args:
            text: The instruction.

        Returns:
            Indices of the objects (-1 for none) that the most similar point and the middle of the
            most similar region lie on, and of the visible object most similar on average.
        """
        phrase = parse_instruction(text).target_phrase
        if phrase not in self._answers:
            self._answers[phrase] = self._find(phrase)
        return self._answers[phrase]

    def chance(self, question: Question) -> tuple[float, float]:
        """Return the odds that a point on an object, and a visible object, are right by chance."""
        is_target = np.isin(np.arange(len(self._counts)), question.targets)
        on_objects = self._counts[is_target].sum() / self._counts.sum()
        return float(on_objects), float(is_target[self.visible].mean())

    def _find(self, phrase: str) -> tuple[int, int, int]:
        similarity = self._scorer.score(self._cloud.features, phrase)
        region = self._cloud.points[self._region(similarity)].mean(axis=0)
        means = [similarity[self.owners == index].mean() for index in self.visible]
        return (
            int(self.owners[np.argmax(similarity)]),
            int(self.owners[self._tree.query(region)[1]]),
            int(self.visible[np.argmax(means)]),
        )

    def _region(self, similarity: np.ndarray) -> np.ndarray:
        """Return the indices of the region that the grounding policy would act on."""
        cloud, config = self._cloud, self._config
        smoothed = SmoothedSimilarity(
            cloud.points, similarity, cloud.confidence, config.smoothing_radius_m, self._pairs
        )
        return smoothed.best_region(config.region_level)


def examine(
    examiner: Examiner,
) -> Iterator[tuple[Question, tuple[int, int, int], Mark, tuple[float, float]]]:
    """Ask every question of a scene.

    Args:
        examiner: The examiner.

    Yields:
        The question, the answers (see `Examiner.ask`), whether they are right, and the odds of
        that by chance (see `Examiner.chance`).
    """
    for question in examiner.questions():
        answers = examiner.ask(question.text)
        point, region, best = (answer in question.targets for answer in answers)
        mark = Mark(point=point, region=region, object=best)
        yield question, answers, mark, examiner.chance(question)
