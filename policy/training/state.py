"""Where a run is, on disk: one safetensors file with JSON in its header, replaced at once."""

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from policy.errors import InvalidCheckpointError

_SCHEMA = 1


@dataclass(kw_only=True)
class Progress:
    """How far a run has come.

    Attributes:
        step: Steps made.
        epoch: Epochs completed.
        position: Batches made of the epoch under way.
        sums: Sums over the decisions of the epoch under way: their number, then the losses.
        best_score: Best validation score; lower is better. None before the first.
        best_epoch: Epochs completed when it was reached.
        bad_epochs: Epochs since then.
        seconds: Time spent, interruptions left out.
    """

    step: int = 0
    epoch: int = 0
    position: int = 0
    sums: list[float] = field(default_factory=list)
    best_score: float | None = None
    best_epoch: int = 0
    bad_epochs: int = 0
    seconds: float = 0.0


def save_state(
    path: Path,
    modules: dict[str, nn.Module],
    optimizer: torch.optim.Optimizer,
    progress: Progress,
    identity: dict[str, Any],
) -> None:
    """Write the state; a reader finds the old one or the new one.

    Args:
        path: File, ending in .safetensors.
        modules: Networks by name.
        optimizer: The optimizer; its options are not kept, they are those of the run.
        progress: How far the run has come.
        identity: What must be the same when it goes on; JSON values.
    """
    tensors = {
        f"{name}.{key}": tensor.detach().cpu().contiguous()
        for name, module in modules.items()
        for key, tensor in module.state_dict().items()
    }
    for number, entries in optimizer.state_dict()["state"].items():
        for key, tensor in entries.items():
            tensors[f"optimizer.{number}.{key}"] = tensor.detach().cpu().contiguous()
    # Nothing draws from it today: draws have generators of their own.
    tensors["rng"] = torch.get_rng_state()
    header = {"schema": _SCHEMA, "progress": asdict(progress), "identity": identity}
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        save_file(tensors, temporary, metadata={"state": json.dumps(header)})
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def load_state(
    path: Path,
    modules: dict[str, nn.Module],
    optimizer: torch.optim.Optimizer,
    identity: dict[str, Any],
) -> Progress:
    """Read a state into networks and optimizer.

    Args:
        path: File that `save_state` wrote.
        modules: Networks by name.
        optimizer: The optimizer.
        identity: What must be the same as when it was saved.

    Returns:
        How far the run had come.

    Raises:
        InvalidCheckpointError: If the file can't be read, or is of another run.
    """
    try:
        with safe_open(path, framework="pt") as file:
            header = json.loads((file.metadata() or {})["state"])
            tensors = {key: file.get_tensor(key) for key in file.keys()}
    except (SafetensorError, KeyError, ValueError) as error:
        raise InvalidCheckpointError(
            f"{path}: got a file that can't be read ({type(error).__name__}), expected the state "
            "of a run. Delete it to begin anew."
        ) from error
    if header["schema"] != _SCHEMA:
        raise InvalidCheckpointError(
            f"{path}: got schema {header['schema']}, expected {_SCHEMA}. Begin anew in another "
            "folder."
        )
    _check_identity(path, header["identity"], json.loads(json.dumps(identity)))
    for name, module in modules.items():
        module.load_state_dict(_below(tensors, name))
    state: dict[int, dict[str, Tensor]] = {}
    for key, tensor in _below(tensors, "optimizer").items():
        number, _, entry = key.partition(".")
        state.setdefault(int(number), {})[entry] = tensor
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": state, "param_groups": groups})
    torch.set_rng_state(tensors["rng"])
    return Progress(**header["progress"])


def _below(tensors: dict[str, Tensor], name: str) -> dict[str, Tensor]:
    start = f"{name}."
    return {key.removeprefix(start): t for key, t in tensors.items() if key.startswith(start)}


def _check_identity(path: Path, saved: dict[str, Any], wanted: dict[str, Any]) -> None:
    for name in sorted(saved.keys() | wanted.keys()):
        if saved.get(name) != wanted.get(name):
            raise InvalidCheckpointError(
                f"{path}: got a run with {name}={saved.get(name)}, expected {wanted.get(name)} as "
                "asked for now. Resume it with its own options, or choose another --out."
            )
