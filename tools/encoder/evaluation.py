"""How well encoders ground phrases in held-out pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from models.objects.words import ObjectWords
from perception.encoders.embedded import EmbeddedEncoder
from tools.encoder.maps import cell_shares
from tools.encoder.phrases import Concept, concepts_of
from tools.encoder.pictures import FIRST_OBJECT_ID
from tools.encoder.shards import VIEWS_PER_LAYOUT, Shard, load_shard, shard_paths

KINDS = ("label", "category", "color", "shape", "function")
_MIN_VISIBLE_CELLS = 1.5
_MIN_SHARE = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class EvaluationPicture:
    """A held-out picture.

    Attributes:
        shard: The shard that holds it.
        index: Its index there.
        shares: (N, K) shares of the ids in every cell.
        words: The words of the stage's objects.
    """

    shard: Shard
    index: int
    shares: np.ndarray
    words: tuple[ObjectWords, ...]


@dataclass(frozen=True, kw_only=True)
class Question:
    """A phrase that holds for some, not all, of a picture's objects.

    Attributes:
        picture: Index of the picture.
        kind: One of `KINDS`.
        concept: What is asked for.
        targets: Indices of the visible objects that are right.
        others: Indices of the visible objects that are wrong.
    """

    picture: int
    kind: str
    concept: Concept
    targets: tuple[int, ...]
    others: tuple[int, ...]


def load_pictures(folder: Path, split: str) -> list[EvaluationPicture]:
    """Load a split's pictures: the robot's views and close-ups in turn.

    Args:
        folder: Folder of the data.
        split: The split.

    Returns:
        The pictures.
    """
    pictures = []
    for path in shard_paths(folder, split):
        shard = load_shard(path)
        for layout in range(len(shard.pictures) // VIEWS_PER_LAYOUT):
            index = layout * VIEWS_PER_LAYOUT + 2 * (layout % 3 == 2)
            shares = cell_shares(shard.ids[index])
            pictures.append(
                EvaluationPicture(
                    shard=shard,
                    index=index,
                    shares=shares.reshape(-1, shares.shape[-1]),
                    words=shard.words,
                )
            )
    return pictures


def questions_about(pictures: Sequence[EvaluationPicture]) -> list[Question]:
    """Ask for everything that tells some visible object of a picture from another.

    Args:
        pictures: The pictures.

    Returns:
        The questions.
    """
    questions = []
    for index, picture in enumerate(pictures):
        weight = picture.shares.sum(axis=0)[FIRST_OBJECT_ID:]
        visible = np.flatnonzero(weight >= _MIN_VISIBLE_CELLS).tolist()
        asked: dict[tuple[str, str], tuple[str, Concept]] = {}
        for number in visible:
            concepts = concepts_of(picture.words[number])
            for position, concept in enumerate(concepts):
                if concept.kind != "name" or position == 0:
                    kind = "label" if concept.kind == "name" else concept.kind
                    asked[kind, concept.word] = (kind, concept)
        for kind, concept in asked.values():
            right = {
                i for i in visible
                if any((c.kind, c.word) == (concept.kind, concept.word)
                       for c in concepts_of(picture.words[i]))
            }  # fmt: skip
            if len(right) < len(visible):
                questions.append(
                    Question(
                        picture=index,
                        kind=kind,
                        concept=concept,
                        targets=tuple(sorted(right)),
                        others=tuple(i for i in visible if i not in right),
                    )
                )
    return questions


@torch.no_grad()
def grounding(
    encoder: EmbeddedEncoder, pictures: Sequence[EvaluationPicture], questions: Sequence[Question]
) -> dict[str, dict[str, float]]:
    """Answer the questions.

    Args:
        encoder: The encoder.
        pictures: The pictures.
        questions: Questions about them, in the order of the pictures.

    Returns:
        For every kind, and "all": "cell", the share whose most similar cell of the picture lies on
        a target; "object_cell", the same among cells that show objects; "retrieval", the share
        whose most similar visible object is a target; and "count".
    """
    texts: dict[str, Tensor] = {}
    features: dict[int, Tensor] = {}
    rows: list[tuple[str, float, float, float]] = []
    for question in questions:
        picture = pictures[question.picture]
        if question.picture not in features:
            image = picture.shard.rgb(picture.index)
            maps = encoder.encode_dense([image])[0]
            features = {question.picture: maps.permute(1, 2, 0).reshape(-1, len(maps))}
        feature = features[question.picture]
        phrase = question.concept.phrases[0]
        if phrase not in texts:
            texts[phrase] = torch.from_numpy(encoder.encode_text(phrase).pooled)
        score = (feature @ texts[phrase]).numpy()
        objects = picture.shares[:, FIRST_OBJECT_ID:]
        is_target = objects[:, list(question.targets)].sum(axis=1) >= _MIN_SHARE / 2
        is_object = objects.sum(axis=1) >= _MIN_SHARE
        top, top_object = score.argmax(), np.where(is_object, score, -9).argmax()
        visible = [*question.targets, *question.others]
        weights = torch.from_numpy(objects[:, visible].T)
        pooled = F.normalize(weights @ feature, dim=-1) @ texts[phrase]
        found = int(pooled.argmax()) < len(question.targets)
        rows.append((question.kind, is_target[top], is_target[top_object], found))
    return {
        kind: _means([row[1:] for row in rows if kind in (row[0], "all")])
        for kind in (*KINDS, "all")
    }


def _means(rows: list[tuple[float, ...]]) -> dict[str, float]:
    means = np.mean(rows, axis=0) if rows else np.full(3, np.nan)
    keys = ("cell", "object_cell", "retrieval")
    return {**dict(zip(keys, map(float, means), strict=True)), "count": len(rows)}


def format_table(results: dict[str, dict[str, dict[str, float]]]) -> str:
    """Write results as a Markdown table.

    Args:
        results: Results of `grounding` by the name of the encoder.

    Returns:
        The table, in percent.
    """
    lines = [
        "| encoder | measure | " + " | ".join((*KINDS, "all")) + " |",
        "| --- | --- |" + " ---: |" * (len(KINDS) + 1),
    ]
    for name, result in results.items():
        for measure in ("cell", "object_cell", "retrieval"):
            cells = " | ".join(f"{100 * result[k][measure]:.0f}" for k in (*KINDS, "all"))
            lines.append(f"| {name} | {measure} | {cells} |")
    first = next(iter(results.values()))
    counts = " | ".join(str(first[k]["count"]) for k in (*KINDS, "all"))
    return "\n".join([*lines, f"| | questions | {counts} |"])
