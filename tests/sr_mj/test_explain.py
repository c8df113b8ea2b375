import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from policy.network.checkpoint import save_checkpoint
from policy.network.config import SRConfig
from policy.sr import SRPolicy
from sr_mj.errors import ConfigError
from sr_mj.explain import check_explains
from sr_mj.run import RunConfig, run


@pytest.fixture
def checkpoint(tmp_path: Path) -> Path:
    config = SRConfig(feature_dim=384, width=32, num_heads=4, max_points=64)
    path = tmp_path / "sr.safetensors"
    save_checkpoint(path, SRPolicy.untrained(config, np.random.default_rng(0)).network, {})
    return path


@pytest.mark.render
def test_every_attempt_is_explained(checkpoint: Path, tmp_path: Path, capsys) -> None:
    folder = tmp_path / "new" / "why"
    options = {"scene": "single", "policy": "sr", "checkpoint": checkpoint, "attempts": 1}
    assert run(RunConfig(**options, seed=2, explain=folder)) == 0
    assert "Policy sr" in capsys.readouterr().out
    assert sorted(p.name for p in folder.iterdir()) == [
        "attempt_01_attention.json",
        "attempt_01_attention.png",
    ]
    picture = Image.open(folder / "attempt_01_attention.png")
    assert picture.size == (1600, 900) and np.asarray(picture).std() > 20
    record = json.loads((folder / "attempt_01_attention.json").read_text())
    assert record["phase"] == "pick" and record["instruction"]
    assert record["alpha"] == [{"sparse": 0.5, "dense": 0.5}] * 2
    assert len(record["logits"]) > 5 and np.std(record["logits"]) > 0
    with pytest.raises(ConfigError) as caught:
        run(RunConfig(**options, explain=folder))
    assert str(caught.value) == (
        f"Output folder {str(folder)!r} exists and is not empty; choose a new one."
    )


@pytest.mark.parametrize("name", ["grounding", "random", "oracle"])
def test_policies_without_attention_are_refused(name: str, tmp_path: Path) -> None:
    message = (
        f"Policy {name!r} has no attention to show; leave --explain out, or choose --policy sr."
    )
    with pytest.raises(ConfigError) as caught:
        check_explains(name)
    assert str(caught.value) == message
    folder = tmp_path / "why"
    with pytest.raises(ConfigError) as caught:
        run(RunConfig(policy=name, explain=folder))
    assert str(caught.value) == message and not folder.exists()
