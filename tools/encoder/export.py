"""Writes what was trained as the package ships it."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import torch
from safetensors.torch import save_file
from torch import Tensor

from perception.encoders.embedded import (
    HEAD_WEIGHTS,
    NUM_CLASSES,
    TEXT_DIM,
    TUNED,
    WEIGHT_FILES,
    WEIGHTS_DIR,
    EmbeddedEncoder,
    EmbeddedEncoderConfig,
)
from perception.encoders.head import GroundingHead
from tools.encoder.lattice import tower_names


def export_trained(state: dict[str, Tensor], folder: Path) -> Path:
    """Write head and tuned stages in half precision; the mixture stays with the image weights.

    Args:
        state: State of a `tools.encoder.training.TrainedPart`.
        folder: Folder of the weights.

    Returns:
        The file.
    """
    deviation, mean = state["deviation"], state["mean"]
    # The head reads plain features: fold their standardisation into its first layer.
    weight = state["head.hidden.weight"] / deviation
    bias = state["head.hidden.bias"] - weight @ mean
    tensors = {
        "trained.hidden.weight": weight,
        "trained.hidden.bias": bias,
        "trained.projection.weight": state["head.projection.weight"],
        "trained.projection.bias": state["head.projection.bias"],
    }
    for name, of_tower in tower_names():
        tensor = state[name]
        is_pointwise = tensor.dim() == 2
        tensors[TUNED + of_tower] = tensor[:, :, None, None] if is_pointwise else tensor
    return _write(tensors, state["head.mixture_share"], folder)


@contextmanager
def opened_runs(runs: Sequence[Path]) -> Iterator[dict[str, EmbeddedEncoder]]:
    """Open encoders for comparison.

    Args:
        runs: Folders of runs.

    Yields:
        Encoders by name: "untrained", "shipped", and one for every run.
    """
    encoders = {
        "untrained": EmbeddedEncoder(EmbeddedEncoderConfig(mixture_share=1.0)),
        "shipped": EmbeddedEncoder(),
    }
    with tempfile.TemporaryDirectory() as folder:
        for index, run in enumerate(runs):
            weights = Path(folder) / str(index)
            weights.mkdir()
            for name in set(WEIGHT_FILES) - {HEAD_WEIGHTS}:
                (weights / name).symlink_to(WEIGHTS_DIR / name)
            export_trained(torch.load(run / "trained.pt", weights_only=True), weights)
            encoders[run.name] = EmbeddedEncoder(weights_dir=weights)
        yield encoders


def export_untrained_head(folder: Path) -> Path:
    """Write a head that is the class-name mixture alone: what training starts from.

    Args:
        folder: Folder of the weights.

    Returns:
        The file.
    """
    torch.manual_seed(0)
    head = GroundingHead(num_classes=NUM_CLASSES, text_dim=TEXT_DIM)
    parts = {"hidden": head.hidden, "projection": head.projection}
    tensors = {
        f"trained.{part}.{name}": tensor.detach()
        for part, module in parts.items()
        for name, tensor in module.named_parameters()
    }
    return _write(tensors, torch.tensor(1.0), folder)


def _write(tensors: dict[str, Tensor], mixture_share: Tensor, folder: Path) -> Path:
    halves = {name: tensor.half().contiguous() for name, tensor in tensors.items()}
    halves["mixture_share"] = mixture_share.clone()
    path, part = folder / HEAD_WEIGHTS, folder / f"{HEAD_WEIGHTS}.part"
    save_file(halves, part, metadata={"license": "Apache-2.0", "head": "GroundingHead"})
    part.chmod(0o644)  # safetensors writes files that only their owner may read
    part.replace(path)
    return path
