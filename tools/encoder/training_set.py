"""Cells of rendered pictures in memory, labelled with what can be said of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from perception.encoders.class_mixture import ClassMixtureHead
from perception.encoders.efficientnet import NUM_FINAL_FEATURES
from perception.encoders.embedded import EmbeddedEncoder
from tools.encoder.features import CELLS_PER_OBJECT, CellShard, load_cells
from tools.encoder.phrases import Concept, collect_concepts, encode_phrases, truth
from tools.encoder.pictures import FIRST_OBJECT_ID


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainingSet:
    """All cells in memory.

    Attributes:
        concepts: What can be said.
        phrases: (P, 384) features of all their phrases, one concept after the other.
        starts: (N + 1,) where the phrases of each concept begin.
        is_general: (N,) bool, False for names.
        labels: (N, M) int8, see `tools.encoder.phrases.truth`; M distinct objects.
        cells: (K, D) float16.
        mixtures: (K, 384) float16, the class-name mixture of every cell.
        groups: (G, 6) rows of `cells` that show one object in one picture.
        objects: (G,) column of `labels`.
        background: (B,) rows of `cells`, and places (B,) 1 for the table, 0 for the rest.
        places: See `background`.
    """

    concepts: list[Concept]
    phrases: Tensor
    starts: np.ndarray
    is_general: np.ndarray
    labels: Tensor
    cells: Tensor
    mixtures: Tensor
    groups: np.ndarray
    objects: np.ndarray
    background: np.ndarray
    places: np.ndarray


def gather(paths: Sequence[Path], encoder: EmbeddedEncoder) -> TrainingSet:
    """Load cell shards and label them.

    Args:
        paths: Files of `tools.encoder.features`.
        encoder: The encoder; only its text tower is used.

    Returns:
        The training set.
    """
    shards = [load_cells(path) for path in paths]
    distinct = list(dict.fromkeys(words for shard in shards for words in shard.words))
    column = {words: index for index, words in enumerate(distinct)}
    concepts = collect_concepts(distinct)
    phrases = encode_phrases(encoder, concepts)
    offsets = np.cumsum([0, *(len(shard.ids) for shard in shards)])
    groups, objects, background, places = [], [], [], []
    for shard, offset in zip(shards, offsets, strict=False):
        for which, rows in _runs(shard):
            if which >= FIRST_OBJECT_ID:
                groups.append(offset + rows[:CELLS_PER_OBJECT])
                objects.append(column[shard.words[which - FIRST_OBJECT_ID]])
            else:
                background.append(offset + rows)
                places.append(np.full(len(rows), which))
    cells = torch.from_numpy(np.concatenate([shard.features for shard in shards]))
    return TrainingSet(
        concepts=concepts,
        phrases=torch.from_numpy(np.concatenate(phrases)),
        starts=np.cumsum([0, *(len(p) for p in phrases)]),
        is_general=np.array([concept.kind != "name" for concept in concepts]),
        labels=torch.from_numpy(truth(concepts, phrases, distinct)),
        cells=cells,
        mixtures=_mixtures(encoder.head.mixture, cells),
        groups=np.stack(groups),
        objects=np.array(objects),
        background=np.concatenate(background),
        places=np.concatenate(places),
    )


@torch.no_grad()
def _mixtures(mixture: ClassMixtureHead, cells: Tensor) -> Tensor:
    parts = [mixture(part[:, :NUM_FINAL_FEATURES].bfloat16(), 2.0) for part in cells.split(4096)]
    return torch.cat([part.half() for part in parts])


def _runs(shard: CellShard) -> Iterator[tuple[int, np.ndarray]]:
    """Split cells into runs of the same picture and id."""
    key = shard.pictures.astype(int) * 256 + shard.ids
    for rows in np.split(np.arange(len(key)), np.flatnonzero(np.diff(key)) + 1):
        yield int(shard.ids[rows[0]]), rows
