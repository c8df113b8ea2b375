"""The weights that come with the package."""

import json

import numpy as np
import pytest

from perception import load_encoder
from policy.actions import ActionCandidates
from policy.errors import InvalidCheckpointError
from policy.learnt import WEIGHTS
from policy.network.config import ablation_switches
from policy.observation import Observation
from policy.registry import load_policy

SHIPPED = {"sr": "sr", "sr-a": "sr_a", "base": "base", "a2": "a2", "vlg": "vlg"}


@pytest.fixture(params=SHIPPED)
def name(request):
    return request.param


@pytest.fixture
def card(name):
    return json.loads((WEIGHTS / f"{SHIPPED[name]}.json").read_text())


@pytest.fixture(scope="module")
def texts():
    """Features of three names, (3, D), in the space that the weights know."""
    encoder = load_encoder("embedded")
    return np.stack([encoder.encode_text(x).pooled for x in ("a banana", "a mug", "scissors")])


def test_nothing_else_is_shipped():
    assert {path.stem for path in WEIGHTS.iterdir()} == set(SHIPPED.values())


def test_they_are_small_and_of_their_variant(name, card):
    assert (WEIGHTS / f"{SHIPPED[name]}.safetensors").stat().st_size < 24e6
    if name in ("a2", "vlg"):
        assert card["kind"] == name
    else:
        switches = ablation_switches(SHIPPED[name])
        assert {key: card["config"][key] for key in switches} == switches


def test_the_card_says_where_they_come_from(name, card):
    training = card["training"]
    assert training["command"].startswith("python -m policy.train --data demos ")
    assert f"--variant {SHIPPED[name]} " in training["command"]
    assert training["data"]["decisions"]["train"] >= 4000
    assert training["versions"]["torch"] and len(training["data"]["digest"]) == 64
    # Better than a random choice among its candidates by far; VLG sees segments, not points.
    assert training["metrics"]["val_top1"] > (0.8 if name == "vlg" else 0.85)


def test_they_were_trained_alike():
    cards = [json.loads((WEIGHTS / f"{stem}.json").read_text()) for stem in SHIPPED.values()]
    trainings = [card["training"] for card in cards]
    differing = {"variant", "out"}
    options = [{k: v for k, v in t["options"].items() if k not in differing} for t in trainings]
    assert all(other == options[0] for other in options)
    assert len({t["data"]["digest"] for t in trainings}) == 1
    assert len({card["encoder"] for card in cards}) == 1


def test_they_refuse_features_of_another_encoder(name):
    with pytest.raises(InvalidCheckpointError, match="the policy 'grounding', which takes any"):
        load_policy(name, encoder="ViT-L-14-0123")


@pytest.mark.parametrize("asked", range(3))
def test_they_find_what_is_asked_for(name, texts, asked):
    """Three blobs of points: one has the feature of the phrase, and grasps on it win."""
    rng = np.random.default_rng(asked)
    wanted = texts[asked]
    middles = np.array([[0.45, -0.1, 0.03], [0.5, 0.1, 0.03], [0.6, 0.0, 0.03]])
    owner = np.repeat(np.arange(3), 100)
    features = texts[owner] + rng.normal(scale=0.02, size=(300, len(wanted))).astype(np.float32)
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    observation = Observation(
        points=(middles[owner] + rng.normal(scale=0.01, size=(300, 3))).astype(np.float32),
        features=features,
        similarity=features @ wanted,
        confidence=np.ones(300, np.float32),
        text_tokens=wanted[None],
        text_pooled=wanted,
        phrase_pooled=wanted,
        workspace_min=np.array([0.3, -0.25, -0.01]),
        workspace_max=np.array([0.75, 0.25, 0.4]),
    )
    poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (30, 1, 1))
    grip = np.repeat(np.arange(3), 10)
    poses[:, :3, 3] = middles[grip] + rng.normal(scale=0.005, size=(30, 3))
    candidates = ActionCandidates(
        kind="pick",
        Ts_world_tool=poses,
        width_m=np.full(30, 0.05),
        prior=np.full(30, 0.5),
    )
    logits = load_policy(name).score(observation, candidates, rng).logits
    assert logits[grip == asked].min() > logits[grip != asked].max()
