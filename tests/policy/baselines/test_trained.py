"""The trained baselines as networks: what they may depend on, and what they must not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from policy.baselines.a2 import A2Config
from policy.baselines.heads import BaselineConfig
from policy.baselines.vlg import VLGConfig
from policy.errors import InvalidArrayError, InvalidConfigError
from policy.network.base import CandidateNetwork
from policy.network.batch import SRBatch, SRSample, collate, make_sample
from policy.network.kinds import make_network
from policy.network.loss import SRTarget, SRTargetBatch, collate_targets, sr_loss

SMALL = {"feature_dim": 16, "width": 32, "num_heads": 4, "max_points": 64}
CONFIGS: dict[str, BaselineConfig] = {
    "a2": A2Config(**SMALL),
    "a2-bare": A2Config(**SMALL, prior=False, side=False, local_heads=False, num_layers=2),
    "vlg": VLGConfig(**SMALL),
    "vlg-bare": VLGConfig(**SMALL, prior=False, side=False, phrase=False, local_heads=False),
}


@pytest.fixture(params=CONFIGS)
def config(request: pytest.FixtureRequest) -> BaselineConfig:
    return CONFIGS[request.param]


def _network(config: BaselineConfig) -> CandidateNetwork:
    torch.manual_seed(0)
    network = make_network(config)
    with torch.no_grad():
        # Away from the special values at the start, which would hide mistakes.
        for parameter in network.parameters():
            parameter.add_(torch.randn_like(parameter) * 0.05)
    return network.eval()


@pytest.fixture
def samples(
    rng: np.random.Generator, make_observation, make_candidates, config: BaselineConfig
) -> list[SRSample]:
    sizes = [(40, 5, 7, "pick"), (23, 2, 3, "place"), (64, 8, 1, "pick")]
    return [
        make_sample(
            make_observation(rng, num_points, num_tokens, phrase_pooled=rng.normal(size=16)),
            make_candidates(rng, num_candidates, kind),
            config,
        )
        for num_points, num_tokens, num_candidates, kind in sizes
    ]


def _targets(rng: np.random.Generator, samples: list[SRSample]) -> SRTargetBatch:
    targets = []
    for sample in samples:
        num = len(sample.poses)
        targets.append(
            SRTarget(
                positive=np.arange(num) == rng.integers(num),
                opening_m=rng.uniform(0, 0.085, num),
                avoid_collision=rng.integers(0, 2, num),
                rotvec_tool=rng.normal(0, 0.05, (num, 3)),
            )
        )
    return collate_targets(targets)


def _same(got: torch.Tensor, expected: torch.Tensor) -> None:
    torch.testing.assert_close(got, expected, rtol=0, atol=2e-5)


def test_padding_changes_nothing(config: BaselineConfig, samples: list[SRSample]) -> None:
    network = _network(config)
    together = network(collate(samples))
    for i, sample in enumerate(samples):
        alone, num = network(collate([sample])), len(sample.poses)
        for name in ("logits", "rotvec_tool", "opening_m", "avoid_collision_logit"):
            _same(getattr(together, name)[i, :num], getattr(alone, name)[0])
        assert together.logits[i, num:].eq(float("-inf")).all()


def test_content_of_padding_changes_nothing(
    config: BaselineConfig, samples: list[SRSample]
) -> None:
    network, batch = _network(config), collate(samples)
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
    config: BaselineConfig, samples: list[SRSample]
) -> None:
    network, batch = _network(config), collate(samples[:1])
    order = torch.randperm(7, generator=torch.Generator().manual_seed(0))
    permuted = replace(batch, poses=batch.poses[:, order], prior=batch.prior[:, order])
    _same(network(permuted).logits, network(batch).logits[:, order])


def test_order_of_points_changes_nothing(
    config: BaselineConfig, make_observation, make_candidates, rng: np.random.Generator
) -> None:
    """More points than the network takes, and their segments, found anew."""
    observation, candidates = make_observation(rng, 120), make_candidates(rng)
    order = rng.permutation(120)
    names = ("points", "features", "similarity", "confidence")
    shuffled = replace(observation, **{name: getattr(observation, name)[order] for name in names})
    network = _network(config)
    first, second = (
        network(collate([make_sample(seen, candidates, config)])).logits
        for seen in (observation, shuffled)
    )
    _same(second, first)


def _changes(network: CandidateNetwork, batch: SRBatch, **changes: Any) -> bool:
    difference = network(replace(batch, **changes)).logits - network(batch).logits
    largest = difference[batch.candidate_mask].abs().max().item()
    assert largest == 0 or largest > 1e-5
    return largest > 0


def test_scores_depend_on_what_they_should(config: BaselineConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples)
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


def test_gradient_reaches_every_parameter(
    config: BaselineConfig, samples: list[SRSample], rng: np.random.Generator
) -> None:
    torch.manual_seed(0)
    network = make_network(config)
    sr_loss(network(collate(samples)), _targets(rng, samples), config).backward()
    dead = [
        name
        for name, parameter in network.named_parameters()
        if parameter.grad is None or not parameter.grad.isfinite().all() or not parameter.grad.any()
    ]
    assert dead == []


def test_half_precision_gives_nearly_the_same(
    config: BaselineConfig, samples: list[SRSample], rng: np.random.Generator
) -> None:
    network, batch = _network(config), collate(samples)
    with torch.autocast("cpu", torch.bfloat16):
        half = network(batch)
    torch.testing.assert_close(half.logits.float(), network(batch).logits, rtol=0, atol=0.1)
    sr_loss(half, _targets(rng, samples), config).backward()
    assert all(p.grad is not None and p.grad.isfinite().all() for p in network.parameters())


def test_empty_cloud_and_no_candidates_stay_finite(
    config: BaselineConfig, rng: np.random.Generator, make_observation, make_candidates
) -> None:
    empty = make_sample(make_observation(rng, 0, 0), make_candidates(rng, 4), config)
    none = make_sample(make_observation(rng, 9, 3), make_candidates(rng, 0), config)
    network = _network(config)
    logits = network(collate([empty, none])).logits
    assert logits[0].isfinite().all() and logits[1].eq(float("-inf")).all()
    _same(network(collate([empty])).logits, logits[:1])


def test_moving_everything_with_the_workspace_changes_nothing(
    config: BaselineConfig, rng: np.random.Generator, make_observation, make_candidates
) -> None:
    network, shift = _network(config), np.array([0.3, -0.2, 0.1])
    observation, candidates = make_observation(rng, 60), make_candidates(rng)
    poses = candidates.Ts_world_tool.copy()
    poses[:, :3, 3] += shift
    moved = replace(
        observation,
        points=observation.points + shift,
        workspace_min=observation.workspace_min + shift,
        workspace_max=observation.workspace_max + shift,
    )
    logits = [
        network(collate([make_sample(seen, grasps, config)])).logits
        for seen, grasps in (
            (observation, candidates),
            (moved, replace(candidates, Ts_world_tool=poses)),
        )
    ]
    torch.testing.assert_close(logits[1], logits[0], rtol=0, atol=1e-3)


def test_a_network_of_objects_needs_objects(samples: list[SRSample]) -> None:
    batch = replace(collate(samples), objects=None)
    with pytest.raises(InvalidArrayError, match="objects: got a batch without, expected one made"):
        _network(CONFIGS["vlg"])(batch)


@pytest.mark.parametrize(
    ("kind", "changes", "message"),
    [
        (A2Config, {"num_layers": 0}, "num_layers: got 0, expected above 0."),
        (
            A2Config,
            {"width": 16},
            "width: got 16, expected at least 24: rotary positions take 6 channels of each of the "
            "4 heads.",
        ),
        (VLGConfig, {"num_bias_scales": 0}, "num_bias_scales: got 0, expected above 0."),
        (VLGConfig, {"width": 30}, "width: got 30, expected a multiple of num_heads=4."),
    ],
)
def test_bad_config(kind: type[BaselineConfig], changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        kind(**(SMALL | changes))
    assert str(caught.value) == message
