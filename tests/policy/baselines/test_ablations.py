from pathlib import Path

import numpy as np
import pytest

from policy.base import Policy
from policy.baselines.ablations import BasePolicy, SRAPolicy
from policy.errors import InvalidCheckpointError, MissingCheckpointError
from policy.network.checkpoint import save_checkpoint
from policy.registry import load_policy
from policy.sr import SRPolicy

VARIANTS = {"base": "base", "sr-a": "sr_a"}


def _save(path: Path, make_config, variant: str) -> SRPolicy:
    policy = SRPolicy.untrained(make_config(variant), np.random.default_rng(1))
    save_checkpoint(path, policy.network, {}, encoder="a")
    return policy


@pytest.mark.parametrize("name", VARIANTS)
def test_scores_as_its_network(
    name: str,
    tmp_path: Path,
    make_config,
    make_observation,
    make_candidates,
    rng: np.random.Generator,
) -> None:
    path = tmp_path / "weights.safetensors"
    original = _save(path, make_config, VARIANTS[name])
    loaded = load_policy(name, checkpoint=path, encoder=("a", "b"))
    assert isinstance(loaded, Policy) and loaded.name == name
    observation, candidates = make_observation(rng, 80), make_candidates(rng)
    expected = original.score(observation, candidates, rng).logits
    np.testing.assert_array_equal(loaded.score(observation, candidates, rng).logits, expected)


@pytest.mark.parametrize(("name", "other"), [("base", "sr"), ("base", "sr_a"), ("sr-a", "sr")])
def test_refuses_weights_of_another_variant(
    name: str, other: str, tmp_path: Path, make_config
) -> None:
    path = tmp_path / "weights.safetensors"
    _save(path, make_config, other)
    switch = "one_align" if name == "base" else "dssa"
    with pytest.raises(InvalidCheckpointError) as caught:
        load_policy(name, checkpoint=path)
    assert str(caught.value) == (
        f"{path}: got a network with {switch}=True, expected False for the policy {name!r}. "
        f"Choose weights trained with --variant {VARIANTS[name]}, or the policy that these "
        "belong to."
    )


@pytest.mark.parametrize("name", VARIANTS)
def test_missing_weights(name: str, tmp_path: Path) -> None:
    weights, card = tmp_path / "w.safetensors", tmp_path / "w.json"
    with pytest.raises(MissingCheckpointError) as caught:
        load_policy(name, checkpoint=weights)
    assert str(caught.value) == (
        f"No weights for the policy {name!r}: missing {weights} and {card}. Train them with "
        f"python -m policy.train --variant {VARIANTS[name]} and pass checkpoint=FILE.safetensors, "
        "or use the policy 'grounding', which needs none."
    )


@pytest.mark.parametrize(("policy", "stem"), [(BasePolicy, "base"), (SRAPolicy, "sr_a")])
def test_looks_for_weights_of_its_own(
    policy: type[SRPolicy], stem: str, tmp_path: Path, make_config, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that is shipped under the policy's name, beside those of `sr`."""
    monkeypatch.setattr("policy.learnt.WEIGHTS", tmp_path)
    _save(tmp_path / f"{stem}.safetensors", make_config, stem)
    assert load_policy(policy.name).name == policy.name
