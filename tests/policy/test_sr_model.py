from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
import torch

from policy.actions import ActionCandidates, ActionScores
from policy.network.batch import SRBatch, SRSample, collate, make_sample
from policy.network.config import SRConfig
from policy.network.loss import SRTarget, SRTargetBatch, collate_targets, sr_loss
from policy.network.model import SRNetwork
from policy.observation import Observation

# Switches of what the paper does not have.
PAPER_ONLY = ("prior", "phrase", "side", "similarity", "candidate_bias", "mask_readout")
VARIANTS = [
    ("base", {}),
    ("sr_a", {}),
    ("sr", {}),
    ("sr", {"sparsifier": "relu"}),
    ("sr", {"sparsifier": "softmax"}),
    ("sr", {"self_attention": "full"}),
    ("sr", {"query_fourier": False, "num_encoder_layers": 0}),
    ("sr", {"language_attention": "points"}),
    ("base", {"mask_readout": True}),
    ("sr", dict.fromkeys(PAPER_ONLY, False)),
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
            make_observation(rng, num_points, num_tokens, phrase_pooled=rng.normal(size=16)),
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
        prior=batch.prior + 6.0 * ~batch.candidate_mask,
    )
    torch.testing.assert_close(network(garbage).logits, network(batch).logits, rtol=0, atol=2e-5)


def test_candidates_permute_with_their_scores(config: SRConfig, samples: list[SRSample]) -> None:
    network, batch = _network(config), collate(samples[:1])
    order = torch.randperm(7, generator=torch.Generator().manual_seed(0))
    permuted = replace(batch, poses=batch.poses[:, order], prior=batch.prior[:, order])
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
    places = torch.full_like(batch.phase, 2)
    by_side = (
        network(replace(batch, phase=places + 1)).logits
        - network(replace(batch, phase=places)).logits
    )
    assert bool(by_side[batch.candidate_mask].any()) == config.side
    assert (_changed_logits(network, batch, prior=1 - batch.prior) > 1e-4) == config.prior
    assert _changed_logits(network, batch, features=-batch.features) > 1e-4
    assert _changed_logits(network, batch, positions=-batch.positions) > 1e-5
    uses_similarity = config.similarity or config.language_attention == "points"
    for name, is_used in {
        "pooled": config.one_align,
        "tokens": config.one_align,
        "phrase": config.one_align and config.phrase,
        "similarity": not config.one_align or uses_similarity,
    }.items():
        change = _changed_logits(network, batch, **{name: -getattr(batch, name)})
        assert change > 1e-5 if is_used else change == 0


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
def test_half_precision_gives_nearly_the_same(
    rng: np.random.Generator, make_observation, make_candidates, make_config, ablation: str
) -> None:
    config = make_config(ablation)
    samples = _samples(rng, make_observation, make_candidates, config)
    network, batch, targets = _network(config), collate(samples), _targets(rng, samples)
    with torch.autocast("cpu", torch.bfloat16):
        half = network(batch)
    full = network(batch)
    torch.testing.assert_close(half.logits.float(), full.logits, rtol=0, atol=0.1)
    sr_loss(half, targets, config).backward()
    assert all(p.grad is not None and p.grad.isfinite().all() for p in network.parameters())


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


@pytest.mark.parametrize("ablation", ["base", "sr_a", "sr"])
def test_moving_everything_with_the_workspace_changes_nothing(
    rng: np.random.Generator, make_observation, make_config, ablation: str
) -> None:
    network = _network(make_config(ablation))
    shift = np.array([0.3, -0.2, 0.1])
    observation, candidates = _two_objects(rng, make_observation, 0)
    poses = candidates.Ts_world_tool.copy()
    poses[:, :3, 3] += shift
    moved = replace(candidates, Ts_world_tool=poses)

    def logits(observation: Observation, candidates: ActionCandidates) -> torch.Tensor:
        return network(collate([make_sample(observation, candidates, network.config)])).logits

    expected = logits(observation, candidates)
    with_workspace = replace(
        observation,
        points=observation.points + shift,
        workspace_min=observation.workspace_min + shift,
        workspace_max=observation.workspace_max + shift,
    )
    torch.testing.assert_close(logits(with_workspace, moved), expected, rtol=0, atol=1e-3)
    in_place = replace(observation, points=observation.points + shift)
    assert (logits(in_place, moved) - expected).abs().max() > 1e-2


def test_weights_are_the_softmax_of_inner_products(
    rng: np.random.Generator, make_observation, make_candidates, make_config
) -> None:
    # Eq. (13) and (14), with the evidence that we add: prior and mask are switched off.
    config = make_config(prior=False, mask_readout=False, num_encoder_layers=0)
    network = _network(config).double()
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
