import math
from dataclasses import replace

import pytest
import torch

from policy.network.alignment import (
    ActionAlignment,
    LanguageAlignment,
    PointwiseLanguageAttention,
    scaled_similarity,
)
from policy.network.attention import masked_softmax
from policy.network.batch import DecisionBatch
from policy.network.bias import candidate_basis
from policy.network.config import SRConfig
from policy.network.encoding import fourier_features

CHANNELS, POINTS, TOKENS, CANDIDATES = 24, 40, 6, 5


def _unit(x: torch.Tensor) -> torch.Tensor:
    return x / x.norm(dim=-1, keepdim=True)


def _batch() -> DecisionBatch:
    generator = torch.Generator().manual_seed(0)

    def randn(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    poses = torch.cat([randn(2, CANDIDATES, 3) / 3, _unit(randn(2, CANDIDATES, 4))], dim=-1)
    return DecisionBatch(
        positions=randn(2, POINTS, 3).clamp(-1, 1),
        features=_unit(randn(2, POINTS, CHANNELS)),
        similarity=randn(2, POINTS),
        point_mask=torch.arange(POINTS)[None] < torch.tensor([[POINTS], [25]]),
        tokens=_unit(randn(2, TOKENS, CHANNELS)),
        token_mask=torch.arange(TOKENS)[None] < torch.tensor([[TOKENS], [2]]),
        pooled=_unit(randn(2, CHANNELS)),
        phrase=_unit(randn(2, CHANNELS)),
        poses=poses,
        prior=torch.zeros(2, CANDIDATES, dtype=torch.float64),
        candidate_mask=torch.ones(2, CANDIDATES, dtype=torch.bool),
        phase=torch.tensor([0, 2]),
    )


def _config(**changes: object) -> SRConfig:
    return SRConfig(**({"feature_dim": CHANNELS, "width": 32, "num_heads": 4} | changes))


def _random(module: torch.nn.Module) -> torch.nn.Module:
    torch.manual_seed(0)
    for parameter in module.parameters():
        torch.nn.init.normal_(parameter)
    return module.double()


def _stage(**changes: object) -> LanguageAlignment:
    stage = _random(LanguageAlignment(_config(**changes)))
    assert isinstance(stage, LanguageAlignment)
    return stage


def test_gate_has_mean_one_over_real_points() -> None:
    batch = _batch()
    gate = _stage().gate(batch)
    assert gate.shape == (2, 4, POINTS)
    assert (gate >= 0).all() and not gate[1, :, 25:].any()
    mean = gate.sum(dim=-1) / batch.point_mask.sum(dim=-1)[:, None]
    torch.testing.assert_close(mean, torch.ones(2, 4, dtype=torch.float64))


@pytest.mark.parametrize("phrase", [False, True])
@pytest.mark.parametrize("similarity", [False, True])
def test_gate_equals_the_equation(phrase: bool, similarity: bool) -> None:
    stage, batch = _stage(phrase=phrase, similarity=similarity), _batch()
    gate = stage.gate(batch)
    num_points, num_tokens, dim = 25, 2, 8
    pooled = [batch.pooled[1:], batch.phrase[1:]][: 1 + phrase]
    language = torch.cat([batch.tokens[1, :num_tokens], *pooled])
    q, k = stage.query(language), stage.key(batch.features[1, :num_points])
    seen = batch.similarity[1, :num_points]
    fit = (seen - seen.min()) / (seen.max() - seen.min())
    for h in range(4):
        head = slice(h * dim, (h + 1) * dim)
        expected = torch.zeros(num_points, dtype=torch.float64)
        weights = []
        for t, row in enumerate(language):
            advantage = 0.0 if t < num_tokens else stage.pooled_advantage[t - num_tokens, h]
            weights.append((stage.token_weight(row)[h] + advantage).exp())
        for t in range(len(language)):
            scores = [q[t, head] @ k[i, head] / math.sqrt(dim) for i in range(num_points)]
            attention = torch.stack(scores)
            if stage.similarity_sharpness is not None:
                attention = attention + stage.similarity_sharpness[h] * fit
            attention = attention.exp() / attention.exp().sum()
            expected += (weights[t] / sum(weights) * attention * num_points).detach()
        torch.testing.assert_close(gate[1, h, :num_points].detach(), expected)


def test_gate_starts_from_cosine_and_similarity() -> None:
    # As wide as the features, the projection loses nothing, and one head sees every channel.
    torch.manual_seed(0)
    stage = LanguageAlignment(_config(width=CHANNELS, num_heads=1)).double()
    batch = _batch()
    batch = replace(batch, token_mask=torch.zeros_like(batch.token_mask), phrase=batch.pooled)
    cosine = (batch.features @ batch.pooled[:, :, None]).squeeze(-1)
    fit = scaled_similarity(batch.similarity, batch.point_mask)
    expected = masked_softmax(5.0 * cosine + 8.0 * fit, batch.point_mask)
    expected = expected * batch.point_mask.sum(dim=-1, keepdim=True)
    torch.testing.assert_close(stage.gate(batch)[:, 0], expected, rtol=1e-4, atol=1e-4)


def test_gated_values_equal_the_equation() -> None:
    stage = _stage()
    x = torch.randn(1, POINTS, 32, dtype=torch.float64)
    gate = torch.rand(1, 4, POINTS, dtype=torch.float64)
    per_channel = gate.repeat_interleave(8, dim=1).transpose(1, 2)
    expected = stage.norm(x + stage.out(stage.value(x) * per_channel))
    torch.testing.assert_close(stage(x, gate), expected)


def test_points_gather_from_the_language_one_by_one() -> None:
    stage, batch = _random(PointwiseLanguageAttention(_config())), _batch()
    assert isinstance(stage, PointwiseLanguageAttention)
    x = torch.randn(2, POINTS, 32, dtype=torch.float64)
    language = stage.language(torch.cat([batch.tokens[1, :2], batch.pooled[1:], batch.phrase[1:]]))
    attention, got = stage.attention, []
    for h in range(4):
        head = slice(8 * h, 8 * h + 8)
        scores = attention.query(x[1])[:, head] @ attention.key(language)[:, head].T / math.sqrt(8)
        got.append(scores.softmax(dim=-1) @ attention.value(language)[:, head])
    expected = stage.norm(x[1] + attention.out(torch.cat(got, dim=-1)))
    torch.testing.assert_close(stage(x, batch)[1], expected)


@pytest.mark.parametrize("candidate_bias", [False, True])
def test_second_stage_equals_the_equation(candidate_bias: bool) -> None:
    stage = _random(ActionAlignment(_config(candidate_bias=candidate_bias)))
    assert isinstance(stage, ActionAlignment)
    batch = _batch()
    with torch.no_grad():
        values, mask = torch.randn(2, POINTS, 32).double(), torch.rand(2, 4, POINTS).double()
        basis = candidate_basis(batch.poses, batch.positions, batch.phase > 0, 6)
        states, readout = stage(batch, batch.phase, values, mask, basis)
        num_points, i = 25, 1
        waves = [fourier_features(x, 6) for x in (batch.poses[i, :, :3], batch.positions[i])]
        queries = stage.query_mlp(torch.cat([batch.poses[i], waves[0]], dim=-1))
        queries = queries + stage.phase.weight[2]
        keys = stage.key_mlp(torch.cat([batch.features[i], waves[1]], dim=-1))[:num_points]
        q, k = stage.attention.query(queries), stage.attention.key(keys)
        v = stage.attention.value(values[i, :num_points])
        for c in range(CANDIDATES):
            gathered = torch.zeros(32, dtype=torch.float64)
            for h in range(4):
                head = slice(8 * h, 8 * h + 8)
                scores = torch.stack([q[c, head] @ k[p, head] / 8**0.5 for p in range(num_points)])
                if stage.bias is not None:
                    scores += stage.bias.weight[2, h] @ basis[i, :, c, :num_points]
                weights = scores.softmax(dim=0)
                gathered[head] = weights @ v[:, head]
                seen = weights @ mask[i, h, :num_points].log1p()
                torch.testing.assert_close(readout[i, h, c], seen)
            expected = stage.norm(queries[c] + stage.attention.out(gathered))
            torch.testing.assert_close(states[i, c], expected)


def test_half_of_the_heads_start_at_the_candidate() -> None:
    torch.manual_seed(0)
    stage = ActionAlignment(_config(width=64, num_heads=8)).double()
    batch = _batch()
    # One point lies at the first candidate, every other one far away.
    positions = torch.full_like(batch.positions, 0.9)
    positions[:, 0] = batch.poses[:, 0, :3] = torch.tensor([-0.2, 0.1, 0.0], dtype=torch.float64)
    mask = torch.zeros(2, 8, POINTS, dtype=torch.float64)
    mask[:, :, 0] = 1.0
    batch = replace(batch, positions=positions)
    values = torch.zeros(2, POINTS, 64, dtype=torch.float64)
    basis = candidate_basis(batch.poses, positions, batch.phase > 0, 6)
    readout = stage(batch, batch.phase, values, mask, basis)[1] / math.log(2)
    assert (readout[:, :4, 0] > 0.9).all()
    assert (readout[:, 4:, 0] < 0.2).all()


def test_similarity_spans_zero_to_one_whatever_its_unit() -> None:
    similarity = torch.tensor([[0.2, 0.3, 0.1, 9.0], [1.0, 1.0, 5.0, 5.0], [1.0, 2.0, 3.0, 4.0]])
    mask = torch.tensor([[True] * 3 + [False], [True, True, False, False], [False] * 4])
    scaled = scaled_similarity(similarity, mask)
    torch.testing.assert_close(scaled[0], torch.tensor([0.5, 1.0, 0.0, 0.0]))
    assert not scaled[1:].any()
    torch.testing.assert_close(scaled_similarity(7 * similarity - 3, mask), scaled)


def test_masked_softmax_without_valid_entries_is_zero() -> None:
    scores = torch.tensor([[1.0, 2.0], [3.0, 4.0]])
    mask = torch.tensor([[True, False], [False, False]])
    assert masked_softmax(scores, mask).tolist() == [[1.0, 0.0], [0.0, 0.0]]
