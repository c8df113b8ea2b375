"""Rendered pictures on disk: one file for every stage, made when it is missing."""

import dataclasses
import io
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from models.objects.words import ObjectWords
from tools.encoder.layouts import Lighting, scatter
from tools.encoder.pictures import Photographer
from tools.encoder.stage import NUM_CAMERAS, build_stage

LAYOUTS_PER_SHARD = 6
VIEWS_PER_LAYOUT = 3
PICTURES_PER_SHARD = LAYOUTS_PER_SHARD * VIEWS_PER_LAYOUT
# Every split has seeds of its own.
SPLIT_SEEDS = {"train": 1, "val": 2, "seen": 3, "unseen": 4}


@dataclass(frozen=True, kw_only=True, eq=False)
class Shard:
    """The pictures of one stage.

    Attributes:
        words: The words of every object on it.
        pictures: JPEG files, three views of every layout in a row.
        ids: (N, 136, 240) uint8; see `tools.encoder.pictures`.
    """

    words: tuple[ObjectWords, ...]
    pictures: tuple[bytes, ...]
    ids: np.ndarray

    def rgb(self, index: int) -> np.ndarray:
        """Decode a picture, (544, 960, 3) uint8."""
        return np.asarray(Image.open(io.BytesIO(self.pictures[index])))


def shard_path(folder: Path, split: str, index: int) -> Path:
    """Return the file of a shard."""
    return folder / split / f"shard_{index:04d}.npz"


def render_shard(folder: Path, split: str, index: int) -> Path:
    """Render a shard unless it is there; the same split and index give the same pictures.

    Args:
        folder: Folder of the data.
        split: One of `SPLIT_SEEDS`.
        index: Number of the shard.

    Returns:
        Its file.
    """
    path = shard_path(folder, split, index)
    if path.exists():
        return path
    rng = np.random.default_rng([SPLIT_SEEDS[split], index])
    stage = build_stage(split, rng)
    photographer, lighting = Photographer(stage), Lighting(stage.model)
    pictures: list[bytes] = []
    ids: list[np.ndarray] = []
    for _ in range(LAYOUTS_PER_SHARD):
        data = scatter(stage, rng)
        lighting.draw(rng)
        # Two views like those of the robot's cameras, one from closer by.
        half = NUM_CAMERAS // 2
        cameras = (*rng.permutation(half)[:2], half + int(rng.integers(half)))
        for camera in cameras:
            rgb, id_map = photographer.take(data, stage.cameras[camera].name)
            pictures.append(_jpeg(rgb))
            ids.append(id_map)
    photographer.close()
    _save(path, [asset.words for asset in stage.assets], pictures, np.stack(ids))
    return path


def load_shard(path: Path) -> Shard:
    """Load a shard.

    Args:
        path: Its file.

    Returns:
        The shard.
    """
    with np.load(path) as arrays:
        words = words_from_json(str(arrays["words"]))
        ends = np.cumsum(arrays["jpeg_sizes"])[:-1]
        pictures = np.split(arrays["jpeg"], ends)
        ids = arrays["ids"]
    return Shard(words=words, pictures=tuple(p.tobytes() for p in pictures), ids=ids)


def shard_paths(folder: Path, split: str) -> Iterator[Path]:
    """Iterate over the shards of a split that have been rendered, in order."""
    return iter(sorted((folder / split).glob("shard_*.npz")))


def words_to_json(words: Sequence[ObjectWords]) -> str:
    """Write the words of objects as JSON."""
    return json.dumps([dataclasses.asdict(record) for record in words])


def words_from_json(text: str) -> tuple[ObjectWords, ...]:
    """Read the words of objects from JSON."""
    lists = ("synonyms", "colors", "shapes", "functions")
    return tuple(
        ObjectWords(
            label=record["label"],
            category=record["category"],
            **{name: tuple(record[name]) for name in lists},
        )
        for record in json.loads(text)
    )


def _jpeg(rgb: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(rgb).save(buffer, format="JPEG", quality=94, subsampling=0)
    return buffer.getvalue()


def _save(path: Path, words: list[ObjectWords], pictures: list[bytes], ids: np.ndarray) -> None:
    """Write a shard under a temporary name, so that an interrupted run leaves no half file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.part")
    with part.open("wb") as file:
        np.savez_compressed(
            file,
            words=np.array(words_to_json(words)),
            jpeg=np.frombuffer(b"".join(pictures), np.uint8),
            jpeg_sizes=np.array([len(p) for p in pictures]),
            ids=ids,
        )
    part.replace(path)
