from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
import torch

from policy.actions import ActionCandidates, ActionScores
from policy.network.batch import DecisionBatch, DecisionSample, collate, make_sample
from policy.network.config import SRConfig
from policy.network.loss import choice_loss
from policy.network.model import SRNetwork
from policy.observation import Observation


@pytest.fixture
def samples(make_samples, sr_config: SRConfig) -> list[DecisionSample]:
    return make_samples(sr_config)


def test_order_of_points_changes_nothing(
    sr_config: SRConfig, samples: list[DecisionSample], make_network
) -> None:
    network, batch = make_network(sr_config), collate(samples)
    order = torch.randperm(64, generator=torch.Generator().manual_seed(0)).expand(3, -1)
    torch.testing.assert_close(
        network(batch.take_points(order)).logits, network(batch).logits, rtol=0, atol=2e-5
    )


def test_candidates_are_independent_unless_asked(
    sr_config: SRConfig, samples: list[DecisionSample], make_network
) -> None:
    network, batch = make_network(sr_config), collate(samples[:1])
    poses = batch.poses.clone()
    poses[0, 1:, 0] += 0.5
    change = network(replace(batch, poses=poses)).logits - network(batch).logits
    is_independent = bool(change[0, 0].abs() < 2e-5)
    assert is_independent == (sr_config.self_attention == "diagonal")
    assert (change[0, 1:].abs() > 1e-4).all()


def _changed_logits(network: SRNetwork, batch: DecisionBatch, **changes: torch.Tensor) -> float:
    difference = network(replace(batch, **changes)).logits - network(batch).logits
    return difference[batch.candidate_mask].abs().max().item()


def test_scores_depend_on_every_input(
    sr_config: SRConfig, samples: list[DecisionSample], make_network
) -> None:
    network, batch = make_network(sr_config), collate(samples)
    assert _changed_logits(network, batch, phase=1 - batch.phase) > 1e-4
    places = torch.full_like(batch.phase, 2)
    by_side = (
        network(replace(batch, phase=places + 1)).logits
        - network(replace(batch, phase=places)).logits
    )
    assert bool(by_side[batch.candidate_mask].any()) == sr_config.side
    assert (_changed_logits(network, batch, prior=1 - batch.prior) > 1e-4) == sr_config.prior
    assert _changed_logits(network, batch, features=-batch.features) > 1e-4
    assert _changed_logits(network, batch, positions=-batch.positions) > 1e-5
    uses_similarity = sr_config.similarity or sr_config.language_attention == "points"
    for name, is_used in {
        "pooled": sr_config.one_align,
        "tokens": sr_config.one_align,
        "phrase": sr_config.one_align and sr_config.phrase,
        "similarity": not sr_config.one_align or uses_similarity,
    }.items():
        change = _changed_logits(network, batch, **{name: -getattr(batch, name)})
        assert change > 1e-5 if is_used else change == 0


def test_one_point(
    rng: np.random.Generator, make_observation, make_candidates, make_config, make_network
) -> None:
    config = make_config("sr")
    sample = make_sample(make_observation(rng, 1, 1), make_candidates(rng, 2), config)
    assert make_network(config)(collate([sample])).logits.isfinite().all()


def test_outputs_stay_in_their_ranges(
    sr_config: SRConfig, samples: list[DecisionSample], make_network
) -> None:
    network = make_network(sr_config)
    with torch.no_grad():
        network.decoder.rotation.weight.mul_(1e3)
        network.decoder.opening.weight.mul_(1e3)
    output = network(collate(samples))
    assert (output.rotvec_tool.norm(dim=-1) <= sr_config.max_refinement_rad * (1 + 1e-6)).all()
    assert ((output.opening_m >= 0) & (output.opening_m <= sr_config.max_opening_m)).all()


def test_no_rotation_is_refined_before_training(
    sr_config: SRConfig, samples: list[DecisionSample]
) -> None:
    assert not SRNetwork(sr_config)(collate(samples)).rotvec_tool.any()


def _two_objects(
    rng: np.random.Generator, make_observation: Any, wanted: int, **changes: Any
) -> tuple[Observation, ActionCandidates]:
    """Two clusters of unlike features, one of which is asked for, and candidates on both."""
    centers = np.array([[0.4, -0.1, 0.05], [0.6, 0.1, 0.05]])
    kinds = rng.normal(size=(2, 16))
    kinds /= np.linalg.norm(kinds, axis=1, keepdims=True)
    features = np.repeat(kinds, 30, axis=0) + rng.normal(0, 0.1, (60, 16))
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    observation = make_observation(
        rng,
        60,
        points=np.repeat(centers, 30, axis=0) + rng.normal(0, 0.01, (60, 3)),
        features=features,
        similarity=features @ kinds[wanted],
        text_tokens=rng.normal(size=(5, 16)),
        text_pooled=kinds[wanted],
        **changes,
    )
    poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (10, 1, 1))
    poses[:, :3, 3] = np.repeat(centers, 5, axis=0) + rng.normal(0, 0.01, (10, 3))
    candidates = ActionCandidates(
        kind="pick", Ts_world_tool=poses, width_m=np.full(10, 0.04), prior=rng.uniform(size=10)
    )
    return observation, candidates


@pytest.mark.parametrize("ablation", ["sr_a", "sr"])
def test_untrained_network_prefers_what_is_asked_for(
    rng: np.random.Generator, make_observation, make_config, ablation: str
) -> None:
    torch.manual_seed(0)
    network = SRNetwork(make_config(ablation))
    for decision in range(20):
        wanted = decision % 2
        observation, candidates = _two_objects(rng, make_observation, wanted)
        sample = make_sample(observation, candidates, network.config)
        logits = network(collate([sample])).logits[0]
        on_target = slice(5 * wanted, 5 * wanted + 5)
        others = slice(5 - 5 * wanted, 10 - 5 * wanted)
        assert logits[on_target].mean() > logits[others].mean() + 0.5
        assert int(logits.argmax()) // 5 == wanted


def test_weights_are_the_softmax_of_inner_products(
    rng: np.random.Generator, make_observation, make_candidates, make_config, make_network
) -> None:
    # Eq. (13) and (14), with the evidence that we add switched off: prior and mask.
    no_evidence = dict.fromkeys(("prior", "mask_readout", "mask_nearness"), False)
    config = make_config(num_encoder_layers=0, **no_evidence)
    network = make_network(config).double()
    sample = make_sample(make_observation(rng), make_candidates(rng), config)
    batch = collate([sample])
    batch = replace(
        batch,
        **{
            f.name: getattr(batch, f.name).double()
            for f in fields(batch)
            if f.name != "objects" and getattr(batch, f.name).is_floating_point()
        },
    )
    states = []
    network.decoder.register_forward_pre_hook(lambda _, inputs: states.append(inputs[0]))
    logits = network(batch).logits[0]
    query, rows = network.decoder.query.tolist(), states[0][0].tolist()
    expected = [sum(a * b for a, b in zip(query, row, strict=True)) / 32**0.5 for row in rows]
    weights = np.exp(expected) / np.exp(expected).sum()
    np.testing.assert_allclose(logits.detach().numpy(), expected, atol=1e-10)
    scores = ActionScores(logits=logits.detach().numpy())
    np.testing.assert_allclose(scores.probabilities, weights, atol=1e-6)
    assert scores.probabilities.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("ablation", ["base", "sr_a", "sr"])
def test_fits_a_handful_of_decisions(
    rng: np.random.Generator,
    make_observation,
    make_candidates,
    make_config,
    ablation: str,
    make_samples,
    make_targets,
) -> None:
    config = make_config(ablation)
    samples = make_samples(config)[:2] * 2
    targets = make_targets(samples[:2])
    batch = collate(samples[:2])
    torch.manual_seed(0)
    network = SRNetwork(config)
    optimizer = torch.optim.Adam(network.parameters(), lr=3e-3)
    losses = []
    for _ in range(80):
        loss = choice_loss(network(batch).logits, targets.positive)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[0] > 0.5
    assert losses[-1] < 0.02
