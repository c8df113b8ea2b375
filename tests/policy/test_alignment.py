import math

import torch

from policy.network.alignment import LanguageAlignment
from policy.network.attention import masked_softmax
from policy.network.config import SRConfig

CHANNELS, POINTS, TOKENS = 24, 40, 6


def _inputs() -> dict[str, torch.Tensor]:
    generator = torch.Generator().manual_seed(0)
    features = torch.randn(2, POINTS, CHANNELS, generator=generator)
    tokens = torch.randn(2, TOKENS, CHANNELS, generator=generator)
    pooled = torch.randn(2, CHANNELS, generator=generator)
    return {
        "features": features / features.norm(dim=-1, keepdim=True),
        "point_mask": torch.arange(POINTS)[None] < torch.tensor([[POINTS], [25]]),
        "tokens": tokens / tokens.norm(dim=-1, keepdim=True),
        "token_mask": torch.arange(TOKENS)[None] < torch.tensor([[TOKENS], [2]]),
        "pooled": pooled / pooled.norm(dim=-1, keepdim=True),
    }


def _stage(*, is_random: bool = False, width: int = 32) -> LanguageAlignment:
    torch.manual_seed(0)
    stage = LanguageAlignment(SRConfig(feature_dim=CHANNELS, width=width, num_heads=4))
    if is_random:
        with torch.no_grad():
            for parameter in stage.parameters():
                parameter.copy_(torch.randn_like(parameter))
    return stage


def test_gate_has_mean_one_over_real_points() -> None:
    inputs = _inputs()
    gate = _stage(is_random=True).gate(**inputs)
    assert gate.shape == (2, 4, POINTS)
    assert (gate >= 0).all() and not gate[1, :, 25:].any()
    mean = gate.sum(dim=-1) / inputs["point_mask"].sum(dim=-1)[:, None]
    torch.testing.assert_close(mean, torch.ones(2, 4))


def test_gate_equals_the_equation() -> None:
    stage, inputs = _stage(is_random=True), _inputs()
    gate = stage.gate(**inputs)
    num_points, num_tokens, dim = 25, 2, 8
    language = torch.cat([inputs["tokens"][1, :num_tokens], inputs["pooled"][1:]])
    q, k = stage.query(language), stage.key(inputs["features"][1, :num_points])
    for h in range(4):
        head = slice(h * dim, (h + 1) * dim)
        attention = (q[:, head] @ k[:, head].T / math.sqrt(dim)).softmax(dim=-1)
        token_scores = stage.token_weight(language)[:, h].clone()
        token_scores[-1] += stage.pooled_advantage[h]
        expected = token_scores.softmax(dim=0) @ attention * num_points
        torch.testing.assert_close(gate[1, h, :num_points], expected, rtol=1e-4, atol=1e-5)


def test_gate_starts_from_cosine_similarity() -> None:
    # As wide as the features, the projection loses nothing, and one head sees every channel.
    torch.manual_seed(0)
    stage = LanguageAlignment(SRConfig(feature_dim=CHANNELS, width=CHANNELS, num_heads=1))
    inputs = _inputs()
    inputs["token_mask"] = torch.zeros_like(inputs["token_mask"])
    cosine = (inputs["features"] @ inputs["pooled"][:, :, None]).squeeze(-1)
    expected = masked_softmax(10.0 * cosine, inputs["point_mask"])
    expected = expected * inputs["point_mask"].sum(dim=-1, keepdim=True)
    torch.testing.assert_close(stage.gate(**inputs)[:, 0], expected, rtol=1e-4, atol=1e-4)


def test_gated_values_equal_the_equation() -> None:
    stage = _stage(is_random=True)
    x = torch.randn(1, POINTS, 32, generator=torch.Generator().manual_seed(1))
    gate = torch.rand(1, 4, POINTS, generator=torch.Generator().manual_seed(2))
    per_channel = gate.repeat_interleave(8, dim=1).transpose(1, 2)
    expected = stage.norm(x + stage.out(stage.value(x) * per_channel))
    torch.testing.assert_close(stage(x, gate), expected)


def test_masked_softmax_without_valid_entries_is_zero() -> None:
    scores = torch.tensor([[1.0, 2.0], [3.0, 4.0]])
    mask = torch.tensor([[True, False], [False, False]])
    assert masked_softmax(scores, mask).tolist() == [[1.0, 0.0], [0.0, 0.0]]
