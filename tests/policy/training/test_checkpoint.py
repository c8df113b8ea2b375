import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from policy.errors import InvalidCheckpointError
from policy.network.checkpoint import load_checkpoint, save_checkpoint
from policy.network.model import SRNetwork


@pytest.fixture
def network(make_config) -> SRNetwork:
    torch.manual_seed(0)
    return SRNetwork(make_config())


def test_half_precision_is_rounded_once(network: SRNetwork, tmp_path: Path) -> None:
    path = tmp_path / "sr.safetensors"
    save_checkpoint(path, network, {"epoch": 3}, encoder="embedded-1", half=True)
    assert {t.dtype for t in load_file(path).values()} == {torch.float16}
    loaded = load_checkpoint(path, SRNetwork).state_dict()
    for name, tensor in network.state_dict().items():
        assert loaded[name].dtype == torch.float32
        torch.testing.assert_close(loaded[name], tensor.half().float(), rtol=0, atol=0)
    card = json.loads(path.with_suffix(".json").read_text())
    assert card["encoder"] == "embedded-1" and card["training"] == {"epoch": 3}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sr.json", "sr.safetensors"]


@pytest.mark.parametrize(
    ("trained_on", "in_use"),
    [("a", "a"), ("a", ("b", "a")), ("a", None), (None, "a"), (None, None)],
)
def test_encoder_fits_or_is_unknown(
    trained_on: str | None, in_use: Any, network: SRNetwork, tmp_path: Path
) -> None:
    path = tmp_path / "sr.safetensors"
    save_checkpoint(path, network, {}, encoder=trained_on)
    assert isinstance(load_checkpoint(path, SRNetwork, encoder=in_use), SRNetwork)


def test_another_encoder(network: SRNetwork, tmp_path: Path) -> None:
    path = tmp_path / "sr.safetensors"
    save_checkpoint(path, network, {}, encoder="embedded-1")
    with pytest.raises(InvalidCheckpointError) as caught:
        load_checkpoint(path, SRNetwork, encoder="ViT-L-14:openai-2")
    assert str(caught.value) == (
        f"{path}: got weights trained on features of the encoder embedded-1, expected "
        "ViT-L-14:openai-2, which is in use. Choose the encoder that they were trained with, "
        "train anew with python -m policy.train on demonstrations of this one, or use the policy "
        "'grounding', which takes any encoder."
    )


def test_a_failed_write_leaves_the_old_file(network: SRNetwork, tmp_path: Path) -> None:
    path = tmp_path / "sr.safetensors"
    save_checkpoint(path, network, {"epoch": 1})
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    with pytest.raises(TypeError):
        save_checkpoint(path, network, {"epoch": np.float32})
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before
