import subprocess
import sys
from pathlib import Path

import pytest

import policy
from policy.base import Policy
from policy.errors import InvalidConfigError, MissingCheckpointError, UnknownPolicyError
from policy.registry import POLICY_NAMES, load_policy

NAMES = (
    "grounding, random, clip-grounding, lerf-togo, think-grasp, vlp, raw-image, raw-image-grid, "
    "a2, vlg, base, sr-a, sr"
)


def test_names() -> None:
    assert POLICY_NAMES == tuple(NAMES.split(", "))


@pytest.mark.parametrize("name", NAMES.split(", ")[:8])
def test_policies_without_weights(name: str) -> None:
    loaded = load_policy(name)
    assert isinstance(loaded, Policy)
    assert loaded.name == name


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("oracle", f"Unknown policy 'oracle'. Policies: {NAMES}."),
        (
            "groundin",
            f"Unknown policy 'groundin'. Policies: {NAMES}. Did you mean 'grounding'?",
        ),
        ("", f"Unknown policy ''. Policies: {NAMES}."),
    ],
)
def test_unknown_policy(name: str, message: str) -> None:
    with pytest.raises(UnknownPolicyError) as caught:
        load_policy(name)
    assert str(caught.value) == message


def test_missing_weights(tmp_path: Path) -> None:
    weights, card = tmp_path / "sr.safetensors", tmp_path / "sr.json"
    with pytest.raises(MissingCheckpointError) as caught:
        load_policy("sr", checkpoint=weights)
    assert str(caught.value) == (
        f"No weights for the policy 'sr': missing {weights} and {card}. Train them with "
        "python -m policy.train --variant sr and pass checkpoint=FILE.safetensors, or use the "
        "policy 'grounding', which needs none."
    )


def test_checkpoint_for_a_policy_without_weights() -> None:
    with pytest.raises(InvalidConfigError) as caught:
        load_policy("random", checkpoint="x.safetensors")
    assert str(caught.value) == (
        "checkpoint: got x.safetensors for the policy 'random', which has no weights. "
        "Leave it out, or use the policy 'sr'."
    )


def test_public_names_resolve() -> None:
    for name in policy.__all__:
        assert getattr(policy, name).__class__ is not None
    with pytest.raises(AttributeError, match="module 'policy' has no attribute 'nothing'"):
        _ = policy.nothing


def test_torch_stays_out_until_needed() -> None:
    program = (
        "import sys, policy; assert not {'torch', 'scipy', 'numpy'} & set(sys.modules); "
        "policy.load_policy('grounding'); assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
