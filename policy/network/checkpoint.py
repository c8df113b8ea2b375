"""Weights of the network on disk: safetensors, and a JSON card that says what they are."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from policy.errors import InvalidCheckpointError, InvalidConfigError, MissingCheckpointError
from policy.network.config import SRConfig
from policy.network.model import SRNetwork

_FORMAT = 1


def save_checkpoint(path: Path, network: SRNetwork, training: dict[str, Any]) -> None:
    """Write weights and card.

    Args:
        path: File of the weights, ending in .safetensors; the card goes beside it with .json.
        network: The network.
        training: What a reader must know of the training: data, encoder, epochs, seed, losses.
            JSON values.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    weights = {name: tensor.contiguous().cpu() for name, tensor in network.state_dict().items()}
    save_file(weights, path)
    card = {"format": _FORMAT, "config": asdict(network.config), "training": training}
    path.with_suffix(".json").write_text(json.dumps(card, indent=2, sort_keys=True) + "\n")


def load_checkpoint(path: Path) -> SRNetwork:
    """Read weights and card.

    Args:
        path: File of the weights; the card must lie beside it with the suffix .json.

    Returns:
        The network in evaluation mode, on the CPU.

    Raises:
        MissingCheckpointError: If either file is missing.
        InvalidCheckpointError: If the card or the weights don't fit this version.
    """
    card_path = path.with_suffix(".json")
    missing = [str(p) for p in (path, card_path) if not p.is_file()]
    if missing:
        raise MissingCheckpointError(
            f"No weights for the policy 'sr': missing {' and '.join(missing)}. Pass "
            "checkpoint=FILE.safetensors, or use the policy 'grounding', which needs no weights."
        )
    network = SRNetwork(_read_config(card_path))
    try:
        network.load_state_dict(load_file(path))
    except (SafetensorError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0]
        raise InvalidCheckpointError(
            f"{path}: got weights that don't fit their card ({reason}), expected those that "
            f"{card_path.name} describes. Save both again with save_checkpoint."
        ) from error
    return network.eval()


def _read_config(card_path: Path) -> SRConfig:
    try:
        card = json.loads(card_path.read_text())
        if card["format"] != _FORMAT:
            raise InvalidCheckpointError(
                f"{card_path}: got format {card['format']!r}, expected {_FORMAT}. "
                "Save the weights again with this version."
            )
        return SRConfig(**card["config"])
    except (json.JSONDecodeError, KeyError, TypeError, InvalidConfigError) as error:
        raise InvalidCheckpointError(
            f"{card_path}: got a card that can't be read ({type(error).__name__}: {error}), "
            "expected format, config and training. Save it again with save_checkpoint."
        ) from error
