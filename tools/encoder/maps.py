"""What the frozen part of the image tower makes of rendered pictures, computed once and kept."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from models.objects.words import ObjectWords
from perception.encoders.efficientnet import NUM_FINAL_FEATURES, NUM_PART_FEATURES, OUTPUT_STRIDE
from perception.encoders.embedded import EmbeddedEncoder
from tools.encoder.disturbance import disturb
from tools.encoder.pictures import FIRST_OBJECT_ID, ID_STEP, OTHER_ID, TABLE_ID
from tools.encoder.shards import VIEWS_PER_LAYOUT, load_shard, words_from_json, words_to_json

MIXED_ID = 255
"""Id of a cell that shows too much of two things to be a lesson in either."""

_MIN_SHARE, _MIN_BACKGROUND_SHARE = 0.35, 0.95
_SEED = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class MapShard:
    """Maps of a shard's pictures; one cell stands for 16 x 16 pixels.

    Attributes:
        words: The words of its objects.
        parts: (P, h, w, 112) float16, the input of the last two stages of the tower.
        rest: (P, h, w, 88) float16, what the head reads besides them: surface and colours.
        ids: (P, h, w) uint8, what a cell shows, as in `tools.encoder.pictures`, or `MIXED_ID`.
    """

    words: tuple[ObjectWords, ...]
    parts: np.ndarray
    rest: np.ndarray
    ids: np.ndarray


def cell_shares(ids: np.ndarray) -> np.ndarray:
    """Tell what every cell of the feature map shows.

    Args:
        ids: (H, W) ids of a picture at a quarter of its size.

    Returns:
        (h, w, K) float32 shares of the ids 0..K-1, which sum to one.
    """
    step = OUTPUT_STRIDE // ID_STEP
    height, width = ids.shape[0] // step, ids.shape[1] // step
    one_hot = np.eye(FIRST_OBJECT_ID + 32, dtype=np.float32)[ids]
    return one_hot.reshape(height, step, width, step, -1).mean(axis=(1, 3))


def maps_path(folder: Path, index: int) -> Path:
    """Return the folder of a training shard's maps."""
    return folder / "maps" / f"shard_{index:04d}"


def main_ids(ids: np.ndarray) -> np.ndarray:
    """Say what every cell shows.

    Args:
        ids: (H, W) ids of a picture at a quarter of its size.

    Returns:
        (h, w) uint8 ids; `MIXED_ID` where no object covers enough and the background is not pure.
    """
    shares = cell_shares(ids)
    main = shares.argmax(axis=-1).astype(np.uint8)
    objects = shares[..., FIRST_OBJECT_ID:]
    # An object's rim counts for the object: small ones have no other cells.
    is_object = objects.max(axis=-1) >= _MIN_SHARE
    main[is_object] = FIRST_OBJECT_ID + objects.argmax(axis=-1)[is_object].astype(np.uint8)
    background = shares[..., [OTHER_ID, TABLE_ID]].max(axis=-1)
    main[~is_object & (background < _MIN_BACKGROUND_SHARE)] = MIXED_ID
    return main


@torch.no_grad()
def extract_maps(encoder: EmbeddedEncoder, source: Path, target: Path) -> None:
    """Compute the maps of a shard, unless they are there.

    Args:
        encoder: The encoder; only its trunk is used.
        source: Rendered shard.
        target: Folder to write.
    """
    if target.exists():
        return
    shard = load_shard(source)
    rng = np.random.default_rng([_SEED, int(source.stem.split("_")[1])])
    # New objects teach more than a further view of the same ones: one view of three is left out.
    chosen = [i for i in range(len(shard.pictures)) if i % VIEWS_PER_LAYOUT != 1]
    parts, rest = [], []
    for index in chosen:
        cells = encoder.encode_cells([disturb(shard.rgb(index), rng)])[0]
        _, part, other = split_cells(cells)
        parts.append(part.half().numpy())
        rest.append(other.half().numpy())
    temporary = target.with_suffix(".part")
    temporary.mkdir(parents=True, exist_ok=True)
    np.save(temporary / "parts.npy", np.stack(parts))
    np.save(temporary / "rest.npy", np.stack(rest))
    np.save(temporary / "ids.npy", np.stack([main_ids(shard.ids[index]) for index in chosen]))
    (temporary / "words.json").write_text(words_to_json(shard.words))
    temporary.rename(target)


def split_cells(cells: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Split cell features.

    Args:
        cells: (..., NUM_CELL_FEATURES).

    Returns:
        The final 1280 features, the 112 of the part stage, and the rest.
    """
    parts = NUM_FINAL_FEATURES + NUM_PART_FEATURES
    return cells[..., :NUM_FINAL_FEATURES], cells[..., NUM_FINAL_FEATURES:parts], cells[..., parts:]


def load_maps(path: Path) -> MapShard:
    """Open the maps of a shard; arrays stay on disk until they are read.

    Args:
        path: Its folder.

    Returns:
        The maps.
    """
    parts, rest, ids = (
        np.load(path / f"{name}.npy", mmap_mode="r") for name in ("parts", "rest", "ids")
    )
    words = words_from_json((path / "words.json").read_text())
    return MapShard(words=words, parts=parts, rest=rest, ids=np.asarray(ids))
