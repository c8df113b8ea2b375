"""The trained baselines as networks: what they may depend on, and what they must not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from policy.baselines.heads import BaselineConfig
from policy.baselines.vlg import VLGConfig
from policy.errors import InvalidArrayError, InvalidConfigError
from policy.network.base import CandidateNetwork
from policy.network.batch import DecisionBatch, DecisionSample, collate, make_sample


@pytest.fixture
def samples(make_samples, baseline_config: BaselineConfig) -> list[DecisionSample]:
    return make_samples(baseline_config)


def test_order_of_points_changes_nothing(
    baseline_config: BaselineConfig,
    make_network,
    make_observation,
    make_candidates,
    rng: np.random.Generator,
) -> None:
    """More points than the network takes, and their segments, found anew."""
    observation, candidates = make_observation(rng, 120), make_candidates(rng)
    order = rng.permutation(120)
    names = ("points", "features", "similarity", "confidence")
    shuffled = replace(observation, **{name: getattr(observation, name)[order] for name in names})
    network = make_network(baseline_config)
    first, second = (
        network(collate([make_sample(seen, candidates, baseline_config)])).logits
        for seen in (observation, shuffled)
    )
    torch.testing.assert_close(second, first, rtol=0, atol=2e-5)


def _changes(network: CandidateNetwork, batch: DecisionBatch, **changes: Any) -> bool:
    difference = network(replace(batch, **changes)).logits - network(batch).logits
    largest = difference[batch.candidate_mask].abs().max().item()
    assert largest == 0 or largest > 1e-5
    return largest > 0


def test_scores_depend_on_what_they_should(
    baseline_config: BaselineConfig, samples: list[DecisionSample], make_network
) -> None:
    config = baseline_config
    network, batch = make_network(config), collate(samples)
    assert _changes(network, batch, poses=-batch.poses)
    assert _changes(network, batch, phase=1 - batch.phase)
    places = replace(batch, phase=torch.full_like(batch.phase, 2))
    assert _changes(network, places, phase=places.phase + 1) == config.side
    assert _changes(network, batch, prior=1 - batch.prior) == config.prior
    is_vlg = isinstance(config, VLGConfig)
    for name in ("positions", "features", "similarity"):
        assert _changes(network, batch, **{name: -getattr(batch, name)}) != is_vlg
        if batch.objects is not None:
            turned = replace(batch.objects, **{name: -getattr(batch.objects, name)})
            assert _changes(network, batch, objects=turned)
    for name in ("tokens", "pooled", "phrase"):
        is_known = is_vlg and (name != "phrase" or config.phrase)
        assert _changes(network, batch, **{name: -getattr(batch, name)}) == is_known


def test_a_network_of_objects_needs_objects(
    samples: list[DecisionSample], make_config, make_network
) -> None:
    batch = replace(collate(samples), objects=None)
    with pytest.raises(InvalidArrayError, match="objects: got a batch without, expected one made"):
        make_network(make_config("vlg"))(batch)


@pytest.mark.parametrize(
    ("kind", "changes", "message"),
    [
        ("a2", {"num_layers": 0}, "num_layers: got 0, expected above 0."),
        (
            "a2",
            {"width": 16},
            "width: got 16, expected at least 24: rotary positions take 6 channels of each of the "
            "4 heads.",
        ),
        ("vlg", {"num_bias_scales": 0}, "num_bias_scales: got 0, expected above 0."),
        ("vlg", {"width": 30}, "width: got 30, expected a multiple of num_heads=4."),
    ],
)
def test_bad_config(make_config, kind: str, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        make_config(kind, **changes)
    assert str(caught.value) == message
