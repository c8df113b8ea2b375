import pytest
import torch

from policy.baselines.rotary import RotaryAttention, rotary_frequencies, rotate


def _rows(num: int, seed: int, width: int = 32) -> torch.Tensor:
    return torch.randn(2, num, width, generator=torch.Generator().manual_seed(seed))


def test_frequencies_span_the_workspace() -> None:
    wavelengths = [2 * torch.pi / f for f in rotary_frequencies(32)]
    assert wavelengths == pytest.approx([4.0, 1.6818, 0.7071, 0.2973, 0.125], abs=1e-4)
    assert rotary_frequencies(6) == pytest.approx([torch.pi / 2])


def test_turning_keeps_lengths_and_nothing_turns_at_the_origin() -> None:
    x, positions = torch.randn(2, 4, 5, 16), torch.rand(2, 5, 3) * 2 - 1
    torch.testing.assert_close(rotate(x, positions).norm(dim=-1), x.norm(dim=-1))
    torch.testing.assert_close(rotate(x, torch.zeros(2, 5, 3)), x)
    # 16 channels are 2 frequencies of 3 axes; 4 channels are left as they are.
    torch.testing.assert_close(rotate(x, positions)[..., 12:], x[..., 12:])


@pytest.mark.parametrize("local_heads", [True, False])
def test_only_relative_positions_matter(local_heads: bool) -> None:
    torch.manual_seed(0)
    attention = RotaryAttention(32, 4, local_heads=local_heads).double()
    queries, keys = _rows(6, 1).double(), _rows(9, 2).double()
    here, there = _rows(6, 3, 3).double() * 0.3, _rows(9, 4, 3).double() * 0.3
    mask = torch.ones(2, 9, dtype=torch.bool)
    weights = attention.weights(queries, here, keys, there, mask)
    shift = torch.tensor([0.4, -0.2, 0.7], dtype=torch.float64)
    moved = attention.weights(queries, here + shift, keys, there + shift, mask)
    torch.testing.assert_close(moved, weights, rtol=0, atol=1e-10)
    apart = attention.weights(queries, here, keys, there + shift, mask)
    assert (apart - weights).abs().max() > 1e-3
    torch.testing.assert_close(weights.sum(dim=-1), torch.ones(2, 4, 6, dtype=torch.float64))


def test_half_of_the_heads_start_by_looking_nearby() -> None:
    torch.manual_seed(0)
    attention = RotaryAttention(128, 4, local_heads=True)
    offsets = torch.tensor([[0.0, 0, 0], [0.3, 0, 0], [0.4, -0.5, 0.2], [-0.8, 0.6, 0.3]])
    here = torch.zeros(2, 6, 3)
    keys = _rows(1, 2, 128).expand(-1, 4, -1)
    mask = torch.ones(2, 4, dtype=torch.bool)
    weights = attention.weights(_rows(6, 1, 128), here, keys, offsets.expand(2, -1, -1), mask)
    assert (weights[:, :2, :, 0] > 0.7).all()
    assert weights[:, 2:, :, 0].mean() < 0.5


def test_padding_is_not_looked_at() -> None:
    attention = RotaryAttention(32, 4, local_heads=True)
    mask = torch.tensor([[True, False, True], [False] * 3])
    weights = attention.weights(
        _rows(2, 1), torch.zeros(2, 2, 3), _rows(3, 2), torch.zeros(2, 3, 3), mask
    )
    assert not weights[0, :, :, 1].any() and not weights[1].any()
    torch.testing.assert_close(weights[0].sum(dim=-1), torch.ones(4, 2))
