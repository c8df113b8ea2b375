"""Weights of a network on disk: safetensors, and a JSON card that says what they are."""

import json
import os
from collections.abc import Callable, Collection
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from policy.errors import InvalidCheckpointError, InvalidConfigError, MissingCheckpointError
from policy.network.base import CandidateNetwork
from policy.network.config import NetworkConfig

_FORMAT = 1
# What a card without a kind describes.
_FIRST_KIND = "sr"

Network = TypeVar("Network", bound=CandidateNetwork)


def save_checkpoint(
    path: Path,
    network: CandidateNetwork,
    training: dict[str, Any],
    *,
    encoder: str | None = None,
    half: bool = False,
) -> None:
    """Write weights and card; each file appears complete or not at all.

    Args:
        path: File of the weights, ending in .safetensors; the card goes beside it with .json.
        network: The network.
        training: What a reader must know of the training: data, epochs, seed, losses, versions.
            JSON values.
        encoder: Fingerprint of the encoder whose features the network was trained on; None for one
            that is not trained.
        half: Write half precision, which takes half the space; loading gives single precision.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    dtype = torch.float16 if half else torch.float32
    weights = {
        name: (tensor.to(dtype) if tensor.is_floating_point() else tensor).contiguous().cpu()
        for name, tensor in network.state_dict().items()
    }
    card = {
        "format": _FORMAT,
        "kind": network.config.kind,
        "config": asdict(network.config),
        "encoder": encoder,
        "training": training,
    }
    text = json.dumps(card, indent=2, sort_keys=True) + "\n"
    _replace(path, lambda part: save_file(weights, part))
    _replace(path.with_suffix(".json"), lambda part: part.write_text(text))


def load_checkpoint(
    path: Path, network_type: type[Network], *, encoder: str | Collection[str] | None = None
) -> Network:
    """Read weights and card.

    Args:
        path: File of the weights; the card must lie beside it with the suffix .json.
        network_type: What network they must be of.
        encoder: Fingerprint of the encoder whose features the network will get, or several that
            stand for it, such as those of its precisions; None to take any.

    Returns:
        The network in evaluation mode, on the CPU, in single precision.

    Raises:
        MissingCheckpointError: If either file is missing.
        InvalidCheckpointError: If the card or the weights don't fit this version, are of another
            kind of network, or were trained on another encoder's features.
    """
    card_path = path.with_suffix(".json")
    missing = [str(p) for p in (path, card_path) if not p.is_file()]
    if missing:
        raise MissingCheckpointError(
            f"Missing {' and '.join(missing)}; expected weights and their card side by side, as "
            "python -m policy.train writes them."
        )
    config, trained_on = _read_card(card_path, network_type.config_type)
    accepted = (encoder,) if isinstance(encoder, str) else encoder
    if accepted is not None and trained_on is not None and trained_on not in accepted:
        raise InvalidCheckpointError(
            f"{path}: got weights trained on features of the encoder {trained_on}, expected "
            f"{' or '.join(accepted)}, which is in use. Choose the encoder that they were trained "
            "with, train anew with python -m policy.train on demonstrations of this one, or use "
            "the policy 'grounding', which takes any encoder."
        )
    network = network_type(config)
    try:
        network.load_state_dict(load_file(path))
    except (SafetensorError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0]
        raise InvalidCheckpointError(
            f"{path}: got weights that don't fit their card ({reason}), expected those that "
            f"{card_path.name} describes. {_advice(card_path, network_type.config_type)}"
        ) from error
    return network.eval()


def _advice(card_path: Path, config_type: type[NetworkConfig]) -> str:
    """Say what to do about weights that don't fit, which may be older than an option."""
    told = json.loads(card_path.read_text())["config"]
    untold = [field.name for field in fields(config_type) if field.name not in told]
    if not untold:
        return "Save both again with save_checkpoint."
    return (
        "Save both again with save_checkpoint. If the weights are of an earlier version, whose "
        f"card does not tell {', '.join(untold)}: train anew, or write into its config what they "
        "have."
    )


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        write(part)
        # safetensors writes files that only their owner can read.
        part.chmod(0o644)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _read_card(
    card_path: Path, config_type: type[NetworkConfig]
) -> tuple[NetworkConfig, str | None]:
    try:
        card = json.loads(card_path.read_text())
        if card["format"] != _FORMAT:
            raise InvalidCheckpointError(
                f"{card_path}: got format {card['format']!r}, expected {_FORMAT}. "
                "Save the weights again with this version."
            )
        kind = card.get("kind", _FIRST_KIND)
        if kind != config_type.kind:
            raise InvalidCheckpointError(
                f"{card_path.with_suffix('.safetensors')}: got weights of a network of kind "
                f"{kind!r}, expected {config_type.kind!r}. Choose others, or the policy that these "
                "belong to."
            )
        return config_type(**card["config"]), card.get("encoder")
    except (json.JSONDecodeError, KeyError, TypeError, InvalidConfigError) as error:
        raise InvalidCheckpointError(
            f"{card_path}: got a card that can't be read ({type(error).__name__}: {error}), "
            "expected format, config and training. Save it again with save_checkpoint."
        ) from error
