"""Writes the weights of a trained head as the package ships them."""

from pathlib import Path

import torch
from safetensors.torch import save_file

from perception.encoders.embedded import HEAD_WEIGHTS, NUM_CLASSES, TEXT_DIM
from perception.encoders.head import GroundingHead

_MIXTURE = "mixture."


def export_head(state: dict[str, torch.Tensor], folder: Path) -> Path:
    """Write a head in half precision; the mixture stays with the image weights.

    Args:
        state: State of a `GroundingHead`.
        folder: Folder of the weights.

    Returns:
        The file.
    """
    tensors = {
        f"trained.{name}": tensor.half().contiguous()
        for name, tensor in state.items()
        if not name.startswith(_MIXTURE) and name != "mixture_share"
    }
    tensors["mixture_share"] = state["mixture_share"].clone()
    path, part = folder / HEAD_WEIGHTS, folder / f"{HEAD_WEIGHTS}.part"
    save_file(tensors, part, metadata={"license": "Apache-2.0", "head": "GroundingHead"})
    part.chmod(0o644)  # safetensors writes files that only their owner may read
    part.replace(path)
    return path


def export_untrained_head(folder: Path) -> Path:
    """Write a head that is the class-name mixture alone: what training starts from.

    Args:
        folder: Folder of the weights.

    Returns:
        The file.
    """
    torch.manual_seed(0)
    head = GroundingHead(num_classes=NUM_CLASSES, text_dim=TEXT_DIM)
    head.mixture_share.fill_(1.0)
    return export_head(head.state_dict(), folder)
