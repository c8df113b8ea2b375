"""Features of rendered pictures before the head, computed once and kept on disk."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from models.objects.words import ObjectWords
from perception.encoders.embedded import EmbeddedEncoder
from tools.encoder.pictures import FIRST_OBJECT_ID, ID_STEP
from tools.encoder.shards import (
    VIEWS_PER_LAYOUT,
    Shard,
    load_shard,
    words_from_json,
    words_to_json,
)

CELLS_PER_OBJECT = 6
CELLS_OF_TABLE, CELLS_OF_OTHER = 18, 4
CELL_PX = 16
_MIN_SHARE, _MIN_BACKGROUND_SHARE = 0.35, 0.95
_PLAIN_SHARE = 0.5
_SEED = 7


@dataclass(frozen=True, kw_only=True, eq=False)
class CellShard:
    """Sampled cells of a shard's pictures.

    Attributes:
        words: The words of its objects.
        features: (N, D) float16.
        ids: (N,) uint8, what the cell shows, as in `tools.encoder.pictures`.
        pictures: (N,) uint8, index of the picture.
    """

    words: tuple[ObjectWords, ...]
    features: np.ndarray
    ids: np.ndarray
    pictures: np.ndarray


def cell_shares(ids: np.ndarray) -> np.ndarray:
    """Tell what every cell of the feature map shows.

    Args:
        ids: (H, W) ids of a picture at a quarter of its size.

    Returns:
        (h, w, K) float32 shares of the ids 0..K-1, which sum to one.
    """
    step = CELL_PX // ID_STEP
    height, width = ids.shape[0] // step, ids.shape[1] // step
    one_hot = np.eye(FIRST_OBJECT_ID + 32, dtype=np.float32)[ids]
    return one_hot.reshape(height, step, width, step, -1).mean(axis=(1, 3))


def sample_cells(ids: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Choose cells of a picture: a few of every object, of the table, of the rest.

    Args:
        ids: (H, W) ids of the picture.
        rng: Source of randomness.

    Returns:
        (N,) flat indices into the feature map, and (N,) uint8 ids.
    """
    shares = cell_shares(ids)
    shares = shares.reshape(-1, shares.shape[-1])
    chosen, labels = [], []
    for which in np.flatnonzero(shares.max(axis=0) >= _MIN_SHARE):
        is_object = which >= FIRST_OBJECT_ID
        least = _MIN_SHARE if is_object else _MIN_BACKGROUND_SHARE
        candidates = np.flatnonzero(shares[:, which] >= least)
        count = CELLS_PER_OBJECT if is_object else (CELLS_OF_OTHER, CELLS_OF_TABLE)[which]
        # Objects with few cells repeat them: they count as much as large ones.
        if not is_object:
            count = min(count, len(candidates))
        picked = rng.choice(candidates, count, replace=len(candidates) < count)
        chosen.append(picked)
        labels.append(np.full(count, which, np.uint8))
    return np.concatenate(chosen), np.concatenate(labels)


def disturb(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Change exposure, contrast, white balance, sharpness and noise of half of the pictures.

    Args:
        rgb: (H, W, 3) uint8.
        rng: Source of randomness.

    Returns:
        (H, W, 3) uint8.
    """
    if rng.random() < _PLAIN_SHARE:
        return rgb
    image = rgb.astype(np.float32) / 255
    image = image ** rng.uniform(0.7, 1.4) * rng.uniform(0.8, 1.2)
    image *= 1 + rng.uniform(-0.06, 0.06, 3).astype(np.float32)
    image = (image - 0.5) * rng.uniform(0.8, 1.15) + 0.5
    if rng.random() < 0.4:
        image = (image + np.roll(image, 1, 0) + np.roll(image, 1, 1)) / 3
    image += rng.normal(size=image.shape).astype(np.float32) * rng.uniform(0, 0.03)
    return (255 * np.clip(image, 0, 1)).astype(np.uint8)


def cells_path(folder: Path, index: int) -> Path:
    """Return the file of a training shard's cells."""
    return folder / "cells" / f"shard_{index:04d}.npz"


def extract_cells(encoder: EmbeddedEncoder, source: Path, target: Path) -> None:
    """Compute the features of sampled cells of a shard, unless they are there.

    Args:
        encoder: The encoder; only its trunk is used.
        source: Rendered shard.
        target: File to write.
    """
    if target.exists():
        return
    shard = load_shard(source)
    rng = np.random.default_rng([_SEED, int(source.stem.split("_")[1])])
    features, ids, pictures = [], [], []
    # New objects teach more than a further view of the same ones: one view of three is left out.
    for index in (i for i in range(len(shard.pictures)) if i % VIEWS_PER_LAYOUT != 1):
        cells, labels = sample_cells(shard.ids[index], rng)
        maps = encoder.encode_cells([disturb(shard.rgb(index), rng)])[0]
        rows = maps.reshape(-1, maps.shape[-1])[torch.from_numpy(cells)]
        features.append(rows.half().numpy())
        ids.append(labels)
        pictures.append(np.full(len(cells), index, np.uint8))
    _save(target, shard, np.concatenate(features), np.concatenate(ids), np.concatenate(pictures))


def _save(
    target: Path, shard: Shard, features: np.ndarray, ids: np.ndarray, pictures: np.ndarray
) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_suffix(".part")
    words = words_to_json(shard.words)
    with part.open("wb") as file:
        np.savez(file, words=np.array(words), features=features, ids=ids, pictures=pictures)
    part.replace(target)


def load_cells(path: Path) -> CellShard:
    """Load the cells of a shard.

    Args:
        path: Its file.

    Returns:
        The cells.
    """
    with np.load(path) as arrays:
        return CellShard(
            words=words_from_json(str(arrays["words"])),
            features=arrays["features"],
            ids=arrays["ids"],
            pictures=arrays["pictures"],
        )
