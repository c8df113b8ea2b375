import json
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors import safe_open
from torch import nn

from policy.errors import InvalidCheckpointError
from policy.training.state import Progress, load_state, save_state

IDENTITY = {"lr": 0.1, "batch": 4, "digest": "abc"}


def _made(seed: int, steps: int) -> tuple[nn.Module, torch.optim.Adam]:
    torch.manual_seed(seed)
    module = nn.Sequential(nn.Linear(3, 2), nn.LayerNorm(2))
    optimizer = torch.optim.Adam(module.parameters(), lr=0.1)
    for _ in range(steps):
        _step(module, optimizer)
    return module, optimizer


def _step(module: nn.Module, optimizer: torch.optim.Adam) -> None:
    optimizer.zero_grad()
    (module(torch.arange(6.0).view(2, 3))[:, 0].square().sum() + 1).backward()
    optimizer.step()


def test_going_on_is_as_if_nothing_had_happened(tmp_path: Path) -> None:
    path = tmp_path / "state.safetensors"
    module, optimizer = _made(0, 3)
    progress = Progress(step=3, epoch=1, position=2, sums=[4.0, 1 / 3], best_score=0.1)
    save_state(path, {"network": module}, optimizer, progress, IDENTITY)
    other, other_optimizer = _made(1, 0)
    assert load_state(path, {"network": other}, other_optimizer, IDENTITY) == progress
    for _ in range(3):
        _step(module, optimizer)
        _step(other, other_optimizer)
    for a, b in zip(module.parameters(), other.parameters(), strict=True):
        assert torch.equal(a, b)
    assert [p.name for p in tmp_path.iterdir()] == ["state.safetensors"]


def test_the_file_is_tensors_and_json(tmp_path: Path) -> None:
    path = tmp_path / "state.safetensors"
    save_state(path, {"network": _made(0, 1)[0]}, _made(0, 1)[1], Progress(step=1), IDENTITY)
    with safe_open(path, framework="pt") as file:
        header = json.loads(file.metadata()["state"])
        names = set(file.keys())
    assert header["identity"] == IDENTITY and header["progress"]["step"] == 1
    assert {"network.0.weight", "optimizer.0.exp_avg", "optimizer.0.step", "rng"} <= names


@pytest.mark.parametrize(
    ("identity", "text"),
    [
        ({"lr": 0.2}, "got a run with lr=0.1, expected 0.2 as asked for now."),
        ({"digest": "x"}, "got a run with digest=abc, expected x as asked for now."),
    ],
)
def test_another_run(identity: dict[str, Any], text: str, tmp_path: Path) -> None:
    path = tmp_path / "state.safetensors"
    module, optimizer = _made(0, 1)
    save_state(path, {"network": module}, optimizer, Progress(), IDENTITY)
    with pytest.raises(InvalidCheckpointError) as caught:
        load_state(path, {"network": module}, optimizer, IDENTITY | identity)
    assert str(caught.value) == (
        f"{path}: {text} Resume it with its own options, or choose another --out."
    )


def test_a_damaged_state(tmp_path: Path) -> None:
    path = tmp_path / "state.safetensors"
    module, optimizer = _made(0, 1)
    save_state(path, {"network": module}, optimizer, Progress(), IDENTITY)
    path.write_bytes(path.read_bytes()[:-7])
    with pytest.raises(InvalidCheckpointError) as caught:
        load_state(path, {"network": module}, optimizer, IDENTITY)
    assert str(caught.value) == (
        f"{path}: got a file that can't be read (SafetensorError), expected the state of a run. "
        "Delete it to begin anew."
    )
