"""What holds for every network that scores candidates: SR, its variants, and the baselines."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from policy.network import kinds
from policy.network.batch import DecisionSample, collate, make_sample
from policy.network.config import NetworkConfig, SRConfig
from policy.network.decoder import NetworkOutput
from policy.network.loss import ExpertTargetBatch, choice_loss, decoding_loss


@pytest.fixture
def samples(make_samples, any_config: NetworkConfig) -> list[DecisionSample]:
    return make_samples(any_config)


def _same(got: torch.Tensor, expected: torch.Tensor) -> None:
    torch.testing.assert_close(got, expected, rtol=0, atol=2e-5)


def _loss(output: NetworkOutput, targets: ExpertTargetBatch, config: NetworkConfig) -> torch.Tensor:
    """Sum two terms, which together reach every output."""
    return choice_loss(output.logits, targets.positive) + decoding_loss(output, targets, config)


def test_padding_changes_nothing(
    any_config: NetworkConfig, samples: list[DecisionSample], make_network
) -> None:
    network = make_network(any_config)
    together = network(collate(samples))
    for i, sample in enumerate(samples):
        alone, num = network(collate([sample])), len(sample.poses)
        for name in ("logits", "rotvec_tool", "opening_m", "avoid_collision_logit"):
            _same(getattr(together, name)[i, :num], getattr(alone, name)[0])
        assert together.logits[i, num:].eq(float("-inf")).all()


def test_content_of_padding_changes_nothing(
    any_config: NetworkConfig, samples: list[DecisionSample], make_network
) -> None:
    network, batch = make_network(any_config), collate(samples)
    objects = batch.objects
    if objects is not None:
        outside = ~objects.mask[..., None]
        objects = replace(
            objects,
            features=objects.features + 2.0 * outside,
            similarity=objects.similarity + 3.0 * ~objects.mask,
            positions=objects.positions - 1.0 * outside,
            sizes=objects.sizes + 5.0 * outside,
        )
    garbage = replace(
        batch,
        positions=batch.positions + 3.0 * ~batch.point_mask[..., None],
        features=batch.features - 5.0 * ~batch.point_mask[..., None],
        similarity=batch.similarity - 7.0 * ~batch.point_mask,
        tokens=batch.tokens + 2.0 * ~batch.token_mask[..., None],
        poses=batch.poses + 4.0 * ~batch.candidate_mask[..., None],
        prior=batch.prior + 6.0 * ~batch.candidate_mask,
        objects=objects,
    )
    _same(network(garbage).logits, network(batch).logits)


def test_candidates_permute_with_their_scores(
    any_config: NetworkConfig, samples: list[DecisionSample], make_network
) -> None:
    network, batch = make_network(any_config), collate(samples[:1])
    order = torch.randperm(7, generator=torch.Generator().manual_seed(0))
    permuted = replace(batch, poses=batch.poses[:, order], prior=batch.prior[:, order])
    _same(network(permuted).logits, network(batch).logits[:, order])


def test_gradient_reaches_every_parameter(
    any_config: NetworkConfig, samples: list[DecisionSample], make_targets
) -> None:
    torch.manual_seed(0)
    network = kinds.make_network(any_config)
    _loss(network(collate(samples)), make_targets(samples), any_config).backward()
    dead = [
        name
        for name, parameter in network.named_parameters()
        if parameter.grad is None or not parameter.grad.isfinite().all() or not parameter.grad.any()
    ]
    expected = []
    if isinstance(any_config, SRConfig) and any_config.sparsifier == "softmax":
        # With a softmax in both branches they start equal, and their balance matters to nothing
        # until the convolution has moved.
        expected = [f"dssa_layers.{i}.beta" for i in range(any_config.num_dssa_layers)]
    assert dead == expected


def test_half_precision_gives_nearly_the_same(
    any_config: NetworkConfig, samples: list[DecisionSample], make_network, make_targets
) -> None:
    network, batch = make_network(any_config), collate(samples)
    with torch.autocast("cpu", torch.bfloat16):
        half = network(batch)
    torch.testing.assert_close(half.logits.float(), network(batch).logits, rtol=0, atol=0.1)
    _loss(half, make_targets(samples), any_config).backward()
    assert all(p.grad is not None and p.grad.isfinite().all() for p in network.parameters())


def test_empty_cloud_and_no_candidates_stay_finite(
    any_config: NetworkConfig,
    rng: np.random.Generator,
    make_observation,
    make_candidates,
    make_network,
) -> None:
    empty = make_sample(make_observation(rng, 0, 0), make_candidates(rng, 4), any_config)
    none = make_sample(make_observation(rng, 9, 3), make_candidates(rng, 0), any_config)
    network = make_network(any_config)
    logits = network(collate([empty, none])).logits
    assert logits[0].isfinite().all() and logits[1].eq(float("-inf")).all()
    _same(network(collate([empty])).logits, logits[:1])


def test_moving_everything_with_the_workspace_changes_nothing(
    any_config: NetworkConfig,
    rng: np.random.Generator,
    make_observation,
    make_candidates,
    make_network,
) -> None:
    network, shift = make_network(any_config), np.array([0.3, -0.2, 0.1])
    observation, candidates = make_observation(rng, 60), make_candidates(rng)
    poses = candidates.Ts_world_tool.copy()
    poses[:, :3, 3] += shift
    candidates_there = replace(candidates, Ts_world_tool=poses)
    in_place = replace(observation, points=observation.points + shift)
    with_workspace = replace(
        in_place,
        workspace_min=observation.workspace_min + shift,
        workspace_max=observation.workspace_max + shift,
    )
    here, there, without_workspace = (
        network(collate([make_sample(seen, grasps, any_config)])).logits
        for seen, grasps in (
            (observation, candidates),
            (with_workspace, candidates_there),
            (in_place, candidates_there),
        )
    )
    torch.testing.assert_close(there, here, rtol=0, atol=1e-3)
    # Where something lies in the workspace says little to the baselines before training.
    least = 1e-2 if isinstance(any_config, SRConfig) else 2e-3
    assert (without_workspace - here).abs().max() > least
