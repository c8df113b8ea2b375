from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from policy.network.batch import SRBatch, SRSample, collate, make_sample
from policy.network.config import SRConfig
from policy.network.loss import SRTarget, SRTargetBatch, collate_targets, sr_loss
from policy.network.model import SRNetwork

VARIANTS = [
    ("base", {}),
    ("sr_a", {}),
    ("sr", {}),
    ("sr", {"sparsifier": "relu"}),
    ("sr", {"sparsifier": "softmax"}),
    ("sr", {"self_attention": "full"}),
    ("sr", {"query_fourier": False, "num_encoder_layers": 0}),
]


def _network(config: SRConfig) -> SRNetwork:
    torch.manual_seed(0)
    network = SRNetwork(config)
    with torch.no_grad():
        # Away from the special values at the start, which would hide mistakes.
        for parameter in network.parameters():
            parameter.add_(torch.randn_like(parameter) * 0.05)
    return network.eval()


def _samples(
    rng: np.random.Generator, make_observation: Any, make_candidates: Any, config: SRConfig
) -> list[SRSample]:
    sizes = [(40, 5, 7, "pick"), (23, 2, 3, "place"), (64, 8, 1, "pick")]
    return [
        make_sample(
            make_observation(rng, num_points, num_tokens),
            make_candidates(rng, num_candidates, kind),
            config,
        )
        for num_points, num_tokens, num_candidates, kind in sizes
    ]


def _target(rng: np.random.Generator, sample: SRSample) -> SRTarget:
    num_candidates = len(sample.poses)
    return SRTarget(
        positive=np.arange(num_candidates) == rng.integers(num_candidates),
        opening_m=rng.uniform(0, 0.085, num_candidates),
        avoid_collision=rng.integers(0, 2, num_candidates),
        rotvec_tool=rng.normal(0, 0.05, (num_candidates, 3)),
    )


def _targets(rng: np.random.Generator, samples: list[SRSample]) -> SRTargetBatch:
    return collate_targets([_target(rng, sample) for sample in samples])


@pytest.fixture(params=VARIANTS, ids=lambda v: "-".join([v[0], *map(str, v[1].values())]))
def config(request: pytest.FixtureRequest, make_config) -> SRConfig:
    ablation, changes = request.param
    return make_config(ablation, **changes)


@pytest.fixture
def samples(
    rng: np.random.Generator, make_observation, make_candidates, config: SRConfig
) -> list[SRSample]:
    return _samples(rng, make_observation, make_candidates, config)


def test_padding_changes_nothing(config: SRConfig, samples: list[SRSample]) -> None:
    network = _network(config)
    together = network(collate(samples))
    for i, sample in enumerate(samples):
        alone, num_candidates = network(collate([sample])), len(sample.poses)
        for name in ("logits", "rotvec_tool", "opening_m", "avoid_collision_logit"):
            torch.testing.assert_close(
                getattr(together, name)[i, :num_candidates],
                getattr(alone, name)[0],
                rtol=0,
                atol=2e-5,
            )
        assert together.logits[i, num_candidates:].eq(float("-inf")).all()


def test_content_of_padding_changes_nothing(config: SRConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples)
    garbage = replace(
        batch,
        positions=batch.positions + 3.0 * ~batch.point_mask[..., None],
        features=batch.features - 5.0 * ~batch.point_mask[..., None],
        similarity=batch.similarity - 7.0 * ~batch.point_mask,
        tokens=batch.tokens + 2.0 * ~batch.token_mask[..., None],
        poses=batch.poses + 4.0 * ~batch.candidate_mask[..., None],
    )
    torch.testing.assert_close(network(garbage).logits, network(batch).logits, rtol=0, atol=2e-5)


def test_candidates_permute_with_their_scores(config: SRConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples[:1])
    order = torch.randperm(7, generator=torch.Generator().manual_seed(0))
    permuted = replace(batch, poses=batch.poses[:, order])
    torch.testing.assert_close(
        network(permuted).logits, network(batch).logits[:, order], rtol=0, atol=2e-5
    )


def test_order_of_points_changes_nothing(config: SRConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples)
    order = torch.randperm(64, generator=torch.Generator().manual_seed(0)).expand(3, -1)
    torch.testing.assert_close(
        network(batch.take_points(order)).logits, network(batch).logits, rtol=0, atol=2e-5
    )


def test_candidates_are_independent_unless_asked(config: SRConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples[:1])
    poses = batch.poses.clone()
    poses[0, 1:, 0] += 0.5
    change = network(replace(batch, poses=poses)).logits - network(batch).logits
    is_independent = bool(change[0, 0].abs() < 2e-5)
    assert is_independent == (config.self_attention == "diagonal")
    assert (change[0, 1:].abs() > 1e-4).all()


def _changed_logits(network: SRNetwork, batch: SRBatch, **changes: torch.Tensor) -> float:
    difference = network(replace(batch, **changes)).logits - network(batch).logits
    return difference[batch.candidate_mask].abs().max().item()


def test_scores_depend_on_every_input(config: SRConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples)
    assert _changed_logits(network, batch, phase=1 - batch.phase) > 1e-4
    assert _changed_logits(network, batch, features=-batch.features) > 1e-4
    assert _changed_logits(network, batch, positions=-batch.positions) > 1e-5
    language = {"pooled": -batch.pooled, "tokens": -batch.tokens}
    if config.one_align:
        assert _changed_logits(network, batch, **language) > 1e-5
    else:
        assert _changed_logits(network, batch, similarity=-batch.similarity) > 1e-5


def test_gradient_reaches_every_parameter(
    config: SRConfig, samples: list[SRSample], rng: np.random.Generator
) -> None:
    torch.manual_seed(0)
    network = SRNetwork(config)
    sr_loss(network(collate(samples)), _targets(rng, samples), config).backward()
    dead = [
        name
        for name, parameter in network.named_parameters()
        if parameter.grad is None or not parameter.grad.isfinite().all() or not parameter.grad.any()
    ]
    # With a softmax in both branches they start equal, and their balance matters to nothing until
    # the convolution has moved.
    betas = [f"dssa_layers.{i}.beta" for i in range(config.num_dssa_layers)]
    assert dead == (betas if config.sparsifier == "softmax" else [])


@pytest.mark.parametrize("ablation", ["base", "sr_a", "sr"])
def test_empty_cloud_and_no_candidates_stay_finite(
    rng: np.random.Generator, make_observation, make_candidates, make_config, ablation: str
) -> None:
    config = make_config(ablation)
    empty = make_sample(make_observation(rng, 0, 0), make_candidates(rng, 4), config)
    none = make_sample(make_observation(rng, 9, 3), make_candidates(rng, 0), config)
    network = _network(config)
    logits = network(collate([empty, none])).logits
    assert logits[0].isfinite().all() and logits[1].eq(float("-inf")).all()
    alone = network(collate([empty])).logits
    torch.testing.assert_close(logits[:1], alone, rtol=0, atol=2e-5)


def test_one_point(
    rng: np.random.Generator, make_observation, make_candidates, make_config
) -> None:
    config = make_config("sr")
    sample = make_sample(make_observation(rng, 1, 1), make_candidates(rng, 2), config)
    assert _network(config)(collate([sample])).logits.isfinite().all()


def test_outputs_stay_in_their_ranges(config: SRConfig, samples: list[SRSample]) -> None:
    network = _network(config)
    with torch.no_grad():
        network.decoder.rotation.weight.mul_(1e3)
        network.decoder.opening.weight.mul_(1e3)
    output = network(collate(samples))
    assert (output.rotvec_tool.norm(dim=-1) <= config.max_refinement_rad * (1 + 1e-6)).all()
    assert ((output.opening_m >= 0) & (output.opening_m <= config.max_opening_m)).all()


def test_no_rotation_is_refined_before_training(config: SRConfig, samples: list[SRSample]) -> None:
    assert not SRNetwork(config)(collate(samples)).rotvec_tool.any()


@pytest.mark.parametrize("ablation", ["base", "sr_a", "sr"])
def test_fits_a_handful_of_decisions(
    rng: np.random.Generator, make_observation, make_candidates, make_config, ablation: str
) -> None:
    config = make_config(ablation)
    samples = _samples(rng, make_observation, make_candidates, config)[:2] * 2
    targets = _targets(rng, samples[:2])
    batch = collate(samples[:2])
    torch.manual_seed(0)
    network = SRNetwork(config)
    optimizer = torch.optim.Adam(network.parameters(), lr=3e-3)
    losses = []
    for _ in range(80):
        loss = sr_loss(network(batch), targets, config, decoding_weight=0.0)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[0] > 0.5
    assert losses[-1] < 0.02
