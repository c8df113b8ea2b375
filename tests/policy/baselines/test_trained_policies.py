"""The trained baselines as policies: their weights, and those that they refuse."""

import json
from pathlib import Path

import numpy as np
import pytest

from policy.base import Policy
from policy.baselines.a2 import A2Config
from policy.baselines.vlg import VLGConfig
from policy.errors import InvalidCheckpointError, MissingCheckpointError
from policy.explanation import ExplainingPolicy
from policy.network.base import CandidateNetwork
from policy.network.checkpoint import save_checkpoint
from policy.network.config import SRConfig, ablation_switches
from policy.network.kinds import make_network
from policy.registry import load_policy

SMALL = {"feature_dim": 16, "width": 32, "num_heads": 4, "max_points": 64}
CONFIGS = {
    "a2": A2Config(**SMALL),
    "vlg": VLGConfig(**SMALL),
    "sr": SRConfig(**SMALL),
    "base": SRConfig(**SMALL, **ablation_switches("base")),
}


def _save(path: Path, name: str) -> CandidateNetwork:
    network = make_network(CONFIGS[name])
    save_checkpoint(path, network, {}, encoder="a")
    return network


@pytest.mark.parametrize("name", ["a2", "vlg"])
def test_scores_as_its_network(
    name: str, tmp_path: Path, make_observation, make_candidates, rng: np.random.Generator
) -> None:
    path = tmp_path / "weights.safetensors"
    _save(path, name)
    first, second = (load_policy(name, checkpoint=path, encoder=("a", "b")) for _ in range(2))
    assert isinstance(first, Policy) and first.name == name
    assert not isinstance(first, ExplainingPolicy)
    for num_points, num_candidates, kind in ((120, 7, "pick"), (9, 0, "pick"), (0, 3, "place")):
        observation = make_observation(rng, num_points)
        candidates = make_candidates(rng, num_candidates, kind)
        scores = first.score(observation, candidates, rng)
        assert scores.logits.shape == (num_candidates,) and np.isfinite(scores.logits).all()
        assert scores.decoding is not None and len(scores.decoding.opening_m) == num_candidates
        again = second.score(observation, candidates, np.random.default_rng(7))
        np.testing.assert_array_equal(again.logits, scores.logits)


@pytest.mark.parametrize(
    ("name", "other", "kind"),
    [
        ("a2", "vlg", "vlg"),
        ("a2", "sr", "sr"),
        ("vlg", "base", "sr"),
        ("sr", "a2", "a2"),
        ("base", "vlg", "vlg"),
        ("sr-a", "a2", "a2"),
    ],
)
def test_refuses_another_kind(name: str, other: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "weights.safetensors"
    _save(path, other)
    with pytest.raises(InvalidCheckpointError) as caught:
        load_policy(name, checkpoint=path)
    expected = name if name in ("a2", "vlg") else "sr"
    assert str(caught.value) == (
        f"{path}: got weights of a network of kind {kind!r}, expected {expected!r}. Choose others, "
        "or the policy that these belong to."
    )


def test_a_card_without_a_kind_is_of_the_sr_network(tmp_path: Path) -> None:
    path = tmp_path / "sr.safetensors"
    _save(path, "sr")
    card = json.loads(path.with_suffix(".json").read_text())
    assert card.pop("kind") == "sr"
    path.with_suffix(".json").write_text(json.dumps(card))
    assert load_policy("sr", checkpoint=path).name == "sr"
    with pytest.raises(InvalidCheckpointError, match="network of kind 'sr', expected 'a2'"):
        load_policy("a2", checkpoint=path)


def test_refuses_another_encoder(tmp_path: Path) -> None:
    path = tmp_path / "a2.safetensors"
    _save(path, "a2")
    with pytest.raises(InvalidCheckpointError, match="features of the encoder a, expected b"):
        load_policy("a2", checkpoint=path, encoder="b")


@pytest.mark.parametrize("name", ["a2", "vlg"])
def test_looks_for_weights_of_its_own(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("policy.learnt.WEIGHTS", tmp_path)
    weights, card = tmp_path / f"{name}.safetensors", tmp_path / f"{name}.json"
    with pytest.raises(MissingCheckpointError) as caught:
        load_policy(name)
    assert str(caught.value) == (
        f"No weights for the policy {name!r}: missing {weights} and {card}. Train them with "
        f"python -m policy.train --variant {name} and pass checkpoint=FILE.safetensors, or use "
        "the policy 'grounding', which needs none."
    )
    _save(weights, name)
    assert load_policy(name).name == name
