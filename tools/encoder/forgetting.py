"""How far training has moved the tower away from what ImageNet taught it, on any photographs."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from perception.encoders.efficientnet import NUM_FINAL_FEATURES
from perception.encoders.embedded import EmbeddedEncoder
from tools.encoder.losses import distillation_loss

_ORIGINAL = "untrained"
_SUFFIXES = (".png", ".jpg", ".jpeg")


def load_photos(folder: Path) -> list[np.ndarray]:
    """Load all photographs of a folder.

    Args:
        folder: Has PNG or JPEG files.

    Returns:
        (H, W, 3) uint8 arrays, in the order of the names.

    Raises:
        SystemExit: If there is none.
    """
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
    if not paths:
        raise SystemExit(f"{folder} has no photographs; expected files {', '.join(_SUFFIXES)}.")
    return [np.asarray(Image.open(path).convert("RGB")) for path in paths]


@torch.no_grad()
def compare_classes(
    encoders: Mapping[str, EmbeddedEncoder], photos: Sequence[np.ndarray]
) -> dict[str, tuple[float, float]]:
    """Compare the class probabilities of every cell with those of the original tower.

    Args:
        encoders: Encoders by name, "untrained" among them.
        photos: (H, W, 3) uint8 each.

    Returns:
        For every other encoder the mean Kullback-Leibler divergence in nats, and the share of
        cells whose most probable class is still the same.
    """
    original = encoders[_ORIGINAL]
    results = {}
    for name in (name for name in encoders if name != _ORIGINAL):
        rows = []
        for photo in photos:
            before, after = (_class_logits(e, photo) for e in (original, encoders[name]))
            divergence = distillation_loss(after, before, 1.0).item()
            same = (before.argmax(dim=1) == after.argmax(dim=1)).float().mean().item()
            rows.append((divergence, same))
        divergence, same = np.mean(rows, axis=0).tolist()
        results[name] = (divergence, same)
    return results


def _class_logits(encoder: EmbeddedEncoder, photo: np.ndarray) -> torch.Tensor:
    cells = encoder.encode_cells([photo])[0, ..., :NUM_FINAL_FEATURES]
    return encoder.head.mixture.class_logits(cells.reshape(-1, NUM_FINAL_FEATURES)).float()


def format_comparison(results: Mapping[str, tuple[float, float]]) -> str:
    """Write the results of `compare_classes` as a Markdown table."""
    lines = ["| encoder | divergence, nats | same class, % |", "| --- | ---: | ---: |"]
    lines += [f"| {name} | {d:.2f} | {100 * same:.0f} |" for name, (d, same) in results.items()]
    return "\n".join(lines)
