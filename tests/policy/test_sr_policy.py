import json
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from policy.base import Policy
from policy.errors import InvalidArrayError, InvalidCheckpointError
from policy.explanation import ExplainingPolicy, PolicyExplanation
from policy.network.checkpoint import save_checkpoint
from policy.registry import load_policy
from policy.sr import SRPolicy


@pytest.fixture
def untrained(make_config) -> SRPolicy:
    return SRPolicy.untrained(make_config(), np.random.default_rng(5))


def test_is_a_policy(untrained: SRPolicy) -> None:
    assert isinstance(untrained, Policy)
    assert untrained.name == "sr"


def test_scores_have_every_candidate(
    untrained: SRPolicy, make_observation, make_candidates, rng: np.random.Generator
) -> None:
    scores = untrained.score(make_observation(rng, 200), make_candidates(rng, 11), rng)
    assert scores.logits.shape == (11,) and scores.logits.dtype == np.float32
    assert scores.probabilities.sum() == pytest.approx(1.0)
    assert scores.decoding is not None
    assert scores.decoding.rotvec_tool.shape == (11, 3)


def test_no_candidates(
    untrained: SRPolicy, make_observation, make_candidates, rng: np.random.Generator
) -> None:
    scores = untrained.score(make_observation(rng), make_candidates(rng, 0), rng)
    assert len(scores) == 0
    assert scores.decoding is not None and len(scores.decoding.opening_m) == 0


def test_same_seed_same_bytes(
    make_config, make_observation, make_candidates, rng: np.random.Generator
) -> None:
    observation, candidates = make_observation(rng, 150), make_candidates(rng)
    state = torch.random.get_rng_state()
    first, second, other = (
        SRPolicy.untrained(make_config(), np.random.default_rng(seed))
        .score(observation, candidates, np.random.default_rng(draw))
        .logits.tobytes()
        for draw, seed in enumerate((1, 1, 2))
    )
    assert first == second != other
    assert torch.equal(torch.random.get_rng_state(), state)


@pytest.mark.parametrize("ablation", ["base", "sr_a", "sr"])
@pytest.mark.parametrize("num_candidates", [0, 6])
def test_explanation_belongs_to_the_decision(
    make_config,
    make_observation,
    make_candidates,
    rng: np.random.Generator,
    ablation: str,
    num_candidates: int,
) -> None:
    policy = SRPolicy.untrained(make_config(ablation), np.random.default_rng(5))
    assert isinstance(policy, ExplainingPolicy)
    observation, candidates = make_observation(rng, 150), make_candidates(rng, num_candidates)
    explanation = policy.explain(observation, candidates)
    expected = policy.score(observation, candidates, rng).logits
    np.testing.assert_array_equal(explanation.logits, expected)
    assert explanation.points.shape == (64, 3) and explanation.mask.shape == (4, 64)
    assert {tuple(p) for p in explanation.points} <= {tuple(p) for p in observation.points}
    np.testing.assert_allclose(explanation.mask.mean(axis=1), np.ones(4), rtol=1e-4)
    np.testing.assert_allclose(explanation.mean_mask, explanation.mask.mean(axis=0))
    np.testing.assert_allclose(explanation.alpha, np.full((2 * (ablation == "sr"), 2), 0.5))


def test_explanation_of_small_and_empty_clouds(
    untrained: SRPolicy, make_observation, make_candidates, rng: np.random.Generator
) -> None:
    for num_points in (0, 1, 9):
        explanation = untrained.explain(make_observation(rng, num_points), make_candidates(rng))
        assert explanation.mask.shape == (4, num_points)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": np.zeros((3, 3))}, "mask: got shape (2, 4), expected (H, M=3)."),
        ({"mask": np.zeros((0, 4))}, "mask: got 0 heads, expected at least 1."),
        ({"mask": np.full((2, 4), -1.0)}, "mask: got values from -1 to -1, expected at least 0."),
        ({"alpha": np.full((1, 2), 2.0)}, "alpha: got values from 2 to 2, expected 0 to 1."),
    ],
)
def test_bad_explanations(changes: dict[str, np.ndarray], message: str) -> None:
    good = {
        "points": np.zeros((4, 3)),
        "mask": np.ones((2, 4)),
        "alpha": np.full((1, 2), 0.5),
        "logits": np.zeros(3),
    }
    with pytest.raises(InvalidArrayError) as caught:
        PolicyExplanation(**(good | changes))
    assert str(caught.value) == message


def test_checkpoint_of_another_encoder(untrained: SRPolicy, tmp_path: Path) -> None:
    path = tmp_path / "sr.safetensors"
    save_checkpoint(path, untrained.network, {}, encoder="embedded-1")
    assert load_policy("sr", checkpoint=path, encoder="embedded-1").name == "sr"
    with pytest.raises(InvalidCheckpointError, match="features of the encoder embedded-1"):
        load_policy("sr", checkpoint=path, encoder="ViT-L-14")


def test_checkpoint_round_trip(
    untrained: SRPolicy,
    tmp_path: Path,
    make_observation,
    make_candidates,
    rng: np.random.Generator,
) -> None:
    path = tmp_path / "new" / "sr.safetensors"
    save_checkpoint(path, untrained.network, {"epochs": 3})
    loaded = load_policy("sr", checkpoint=path)
    observation, candidates = make_observation(rng), make_candidates(rng)
    expected = untrained.score(observation, candidates, rng).logits
    np.testing.assert_array_equal(loaded.score(observation, candidates, rng).logits, expected)
    card = json.loads(path.with_suffix(".json").read_text())
    assert card["training"] == {"epochs": 3} and card["config"]["width"] == 32


def test_unreadable_card(untrained: SRPolicy, tmp_path: Path) -> None:
    path, card = tmp_path / "sr.safetensors", tmp_path / "sr.json"
    save_checkpoint(path, untrained.network, {})
    good = json.loads(card.read_text())
    tail = "expected format, config and training. Save it again with save_checkpoint."
    cases = [
        (
            json.dumps(good | {"format": 9}),
            f"{card}: got format 9, expected 1. Save the weights again with this version.",
        ),
        (
            json.dumps({"format": 1}),
            f"{card}: got a card that can't be read (KeyError: 'config'), {tail}",
        ),
        (
            json.dumps(good | {"config": good["config"] | {"width": 33}}),
            f"{card}: got a card that can't be read (InvalidConfigError: width: got 33, expected "
            f"a multiple of num_heads=4.), {tail}",
        ),
        (
            "{",
            f"{card}: got a card that can't be read (JSONDecodeError: Expecting property name "
            f"enclosed in double quotes: line 1 column 2 (char 1)), {tail}",
        ),
    ]
    for text, message in cases:
        card.write_text(text)
        with pytest.raises(InvalidCheckpointError) as caught:
            load_policy("sr", checkpoint=path)
        assert str(caught.value) == message


def test_weights_that_do_not_fit(untrained: SRPolicy, tmp_path: Path) -> None:
    path, card = tmp_path / "sr.safetensors", tmp_path / "sr.json"
    save_checkpoint(path, untrained.network, {})
    good = json.loads(card.read_text())
    card.write_text(json.dumps(good | {"config": good["config"] | {"num_encoder_layers": 2}}))
    with pytest.raises(InvalidCheckpointError) as caught:
        load_policy("sr", checkpoint=path)
    assert str(caught.value) == (
        f"{path}: got weights that don't fit their card (Error(s) in loading state_dict for "
        "SRNetwork:), expected those that sr.json describes. Save both again with save_checkpoint."
    )
    # Weights from before there was an option that adds to them.
    old = {k: v for k, v in good["config"].items() if k != "mask_nearness"}
    card.write_text(json.dumps(good | {"config": old}))
    weights = load_file(path)
    del weights["evidence.nearness_weight"]
    save_file(weights, path)
    with pytest.raises(InvalidCheckpointError) as caught:
        load_policy("sr", checkpoint=path)
    assert str(caught.value).endswith(
        "Save both again with save_checkpoint. If the weights are of an earlier version, whose card "
        "does not tell mask_nearness: train anew, or write into its config what they have."
    )
    card.write_text(json.dumps(good | {"config": old | {"mask_nearness": False}}))
    assert isinstance(load_policy("sr", checkpoint=path), SRPolicy)
    card.write_text(json.dumps(good))
    path.write_bytes(b"not weights")
    with pytest.raises(InvalidCheckpointError, match="weights that don't fit their card"):
        load_policy("sr", checkpoint=path)
