"""Maps of rendered pictures, labelled with what can be said of their objects."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from perception.encoders.embedded import EmbeddedEncoder
from tools.encoder.maps import MapShard, load_maps
from tools.encoder.phrases import (
    POSITIVE,
    Concept,
    collect_concepts,
    encode_phrases,
    truth,
)
from tools.encoder.pictures import FIRST_OBJECT_ID, OTHER_ID, TABLE_ID

CELLS_PER_OBJECT = 4
_CELLS_PER_PLACE = {TABLE_ID: 12, OTHER_ID: 3}


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainingSet:
    """Pictures and words.

    Attributes:
        shards: The maps.
        pictures: (N, 2) shard and index within it.
        columns: For every shard the columns of `labels` of its objects.
        concepts: What can be said.
        phrases: (P, 384) features of all their phrases, one concept after the other.
        starts: (N + 1,) where the phrases of each concept begin.
        is_general: (N,) bool, False for names.
        labels: (N, M) int8, see `tools.encoder.phrases.truth`; M distinct objects.
    """

    shards: tuple[MapShard, ...]
    pictures: np.ndarray
    columns: tuple[np.ndarray, ...]
    concepts: list[Concept]
    phrases: Tensor
    starts: np.ndarray
    is_general: np.ndarray
    labels: Tensor


@dataclass(frozen=True, kw_only=True, eq=False)
class Batch:
    """Some pictures, seen on one of the four lattices of every second cell.

    Attributes:
        parts: (P, h, w, 112) float16, all cells.
        phase: First row and column of the lattice.
        cells: (C,) flat indices into the (P, h / 2, w / 2) cells of the lattice; those of objects
            come first.
        part_cells: (C, 112) float16 and ...
        rest_cells: (C, 88) float16, what the head reads of these cells besides.
        owners: (B,) for the first B cells, the object view that they show, 0..G-1.
        objects: (G,) columns of `TrainingSet.labels`.
        places: (C - B,) ids of the others, `TABLE_ID` or `OTHER_ID`.
    """

    parts: Tensor
    phase: tuple[int, int]
    cells: Tensor
    part_cells: Tensor
    rest_cells: Tensor
    owners: Tensor
    objects: Tensor
    places: np.ndarray


def gather(paths: Sequence[Path], encoder: EmbeddedEncoder) -> TrainingSet:
    """Open map shards and label their objects.

    Args:
        paths: Folders of `tools.encoder.maps`.
        encoder: The encoder; only its text tower is used.

    Returns:
        The training set.
    """
    shards = tuple(load_maps(path) for path in paths)
    distinct = list(dict.fromkeys(words for shard in shards for words in shard.words))
    column = {words: index for index, words in enumerate(distinct)}
    concepts = collect_concepts(distinct)
    phrases = encode_phrases(encoder, concepts)
    return TrainingSet(
        shards=shards,
        pictures=np.array(
            [(s, p) for s, shard in enumerate(shards) for p in range(len(shard.ids))]
        ),
        columns=tuple(np.array([column[w] for w in shard.words]) for shard in shards),
        concepts=concepts,
        phrases=torch.from_numpy(np.concatenate(phrases)),
        starts=np.cumsum([0, *(len(p) for p in phrases)]),
        is_general=np.array([concept.kind != "name" for concept in concepts]),
        labels=torch.from_numpy(truth(concepts, phrases, distinct)),
    )


def draw_batch(data: TrainingSet, num_pictures: int, rng: np.random.Generator) -> Batch:
    """Draw pictures, a lattice, and cells.

    Args:
        data: The training set.
        num_pictures: P.
        rng: Source of randomness.

    Returns:
        The batch.
    """
    row, column = rng.integers(0, 2, 2)
    chosen = data.pictures[rng.choice(len(data.pictures), num_pictures, replace=False)]
    parts, rest, cells, owners, objects = [], [], [], [], []
    backgrounds, places = [], []
    offset = 0
    for shard_index, index in chosen:
        shard = data.shards[shard_index]
        ids = shard.ids[index, row::2, column::2].ravel()
        parts.append(shard.parts[index])
        rest.append(shard.rest[index, row::2, column::2].reshape(len(ids), -1))
        for which in np.unique(ids):
            here = np.flatnonzero(ids == which)
            if which in _CELLS_PER_PLACE:
                picked = _pick(here, _CELLS_PER_PLACE[which], rng)
                backgrounds.append(offset + picked)
                places.append(np.full(len(picked), which))
            elif which - FIRST_OBJECT_ID < len(data.columns[shard_index]):
                picked = _pick(here, CELLS_PER_OBJECT, rng)
                cells.append(offset + picked)
                owners.append(np.full(len(picked), len(objects)))
                objects.append(data.columns[shard_index][which - FIRST_OBJECT_ID])
        offset += len(ids)
    all_parts = torch.from_numpy(np.stack(parts))
    rows = torch.from_numpy(np.concatenate([*cells, *backgrounds]))
    lattice = all_parts[:, row::2, column::2].reshape(offset, -1)
    return Batch(
        parts=all_parts,
        phase=(int(row), int(column)),
        cells=rows,
        part_cells=lattice[rows],
        rest_cells=torch.from_numpy(np.concatenate(rest))[rows],
        owners=torch.from_numpy(np.concatenate(owners)),
        objects=torch.from_numpy(np.array(objects)),
        places=np.concatenate(places),
    )


def choose_concepts(labels: Tensor, num_false: int, rng: np.random.Generator) -> np.ndarray:
    """Choose the concepts that hold for something, and some that hold for nothing here.

    Args:
        labels: (N, M) as in `TrainingSet.labels`.
        num_false: How many of those that hold for nothing.
        rng: Source of randomness.

    Returns:
        Their rows.
    """
    holds = (labels == POSITIVE).any(dim=1).numpy()
    false = rng.permutation(np.flatnonzero(~holds))[:num_false]
    return np.concatenate([np.flatnonzero(holds), false])


def _pick(rows: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    return rng.choice(rows, min(count, len(rows)), replace=False)
