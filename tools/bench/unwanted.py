"""Measure what it helps to know that a reference is not what is asked for.

    python -m tools.bench.unwanted --encoder embedded:untrained --seeds 20012 20052

Every question of a scene is asked with every other object in sight as the reference, by its label:
alone, with the reference as one more negative, and with the reference as `unwanted`. Prints a
markdown table of what the most similar region lies on, as the grounding policy finds it.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import tyro
from tqdm import tqdm

from perception.lifter import MultiViewLifter
from perception.text_scores import DEFAULT_NEGATIVE_PROMPTS, TextScorer
from tools.bench.grounding_answers import Examiner, open_encoder
from tools.bench.grounding_scenes import Question, photograph

_REGION = 1
ROWS = {
    "alone": "the question alone",
    "negative": "the reference as one more negative",
    "unwanted": "two answers multiplied",
}
ANSWERS = ("target", "reference", "another")


@dataclass(frozen=True, kw_only=True)
class UnwantedConfig:
    """What to measure.

    Attributes:
        encoder: Encoder; "embedded:untrained" is the one that the training started from.
        scene: Kind of scene.
        seeds: First seed and one past the last.
    """

    encoder: str = "embedded:untrained"
    scene: str = "pickplace8"
    seeds: tuple[int, int] = (20012, 20052)


class ScorerBesides(TextScorer):
    """Compares features with a text, and knows what else is spoken of."""

    unwanted: tuple[str, ...] = ()

    def score(self, features: np.ndarray, text: str, unwanted: Sequence[str] = ()) -> np.ndarray:
        """Compare features with a text; see `TextScorer.score`."""
        return super().score(features, text, (*self.unwanted, *unwanted))


def main(config: UnwantedConfig) -> None:
    """Measure and print."""
    encoder = open_encoder(config.encoder)
    lifter = MultiViewLifter(encoder)
    counts: dict[str, Counter[str]] = {row: Counter() for row in ROWS}
    for seed in tqdm(range(*config.seeds), desc="scenes"):
        bench = photograph(config.scene, "seen", seed)
        cloud = lifter.lift(bench.views).cloud
        alone = Examiner(bench, cloud, TextScorer(encoder))
        questions = [question for question in alone.questions() if not question.is_paraphrase]
        for index, words in enumerate(bench.words.values()):
            if index not in alone.visible or words.label is None:
                continue
            multiplied = ScorerBesides(encoder)
            multiplied.unwanted = (words.label,)
            negatives = (*DEFAULT_NEGATIVE_PROMPTS, words.label)
            examiners = {
                "alone": alone,
                "negative": Examiner(bench, cloud, TextScorer(encoder, negative_prompts=negatives)),
                "unwanted": Examiner(bench, cloud, multiplied),
            }
            for question in questions:
                if index not in question.targets:
                    for row, examiner in examiners.items():
                        counts[row][_answer(examiner, question, index)] += 1
    total = sum(counts["alone"].values())
    print(f"{total} pairs of a question and a reference, encoder {config.encoder}\n")
    print(f"| most similar region lies on | {' | '.join(ANSWERS)} |")
    print(f"| --- |{' ---: |' * len(ANSWERS)}")
    for row, title in ROWS.items():
        shares = (f"{100 * counts[row][answer] / max(total, 1):.1f} %" for answer in ANSWERS)
        print(f"| {title} | {' | '.join(shares)} |")


def _answer(examiner: Examiner, question: Question, reference: int) -> str:
    found = examiner.ask(question.text)[_REGION]
    if found in question.targets:
        return "target"
    return "reference" if found == reference else "another"


if __name__ == "__main__":
    main(tyro.cli(UnwantedConfig, description=__doc__))
