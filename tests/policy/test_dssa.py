import math
from typing import Any

import numpy as np
import pytest
import torch

from policy.network.bias import RelativePositionBias, position_basis
from policy.network.dssa import DSSALayer, dense_weights, sparse_weights

WIDTH, HEADS, SCALES, POINTS = 16, 4, 3, 9


def _layer(sparsifier: Any = "relu2", *, is_random: bool = False) -> DSSALayer:
    torch.manual_seed(0)
    layer = DSSALayer(WIDTH, HEADS, SCALES, sparsifier)
    if is_random:
        with torch.no_grad():
            for parameter in layer.parameters():
                parameter.copy_(torch.randn_like(parameter) * 0.5)
    return layer


def _inputs(num_padding: int = 0) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    x = torch.randn(1, POINTS, WIDTH, generator=generator)
    positions = torch.rand(1, POINTS, 3, generator=generator) * 2 - 1
    mask = torch.arange(POINTS)[None] < POINTS - num_padding
    return x, position_basis(positions, SCALES), mask


def _naive(layer: DSSALayer, x: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Eq. (7) to (12) with explicit loops over heads, rows and columns; no padding."""
    p = {name: value.detach().double().numpy() for name, value in layer.named_parameters()}
    num_points, dim = len(x), WIDTH // HEADS
    alpha = np.exp(p["beta"]) / np.exp(p["beta"]).sum()
    heads = []
    for h in range(HEADS):
        rows = slice(h * dim, (h + 1) * dim)
        q, k, v = (
            x @ p[f"{name}.weight"][rows].T + p[f"{name}.bias"][rows]
            for name in ("query", "key", "value")
        )
        bias = np.einsum("c,cij->ij", p["bias.weight"][h], basis)
        scores = np.array(
            [[q[i] @ k[j] / math.sqrt(dim) for j in range(num_points)] for i in range(num_points)]
        )
        dense = np.zeros_like(scores)
        for i in range(num_points):
            for j in range(num_points):
                for di in (-1, 0, 1):
                    for dj in (-1, 0, 1):
                        if 0 <= i + di < num_points and 0 <= j + dj < num_points:
                            weight = p["conv.weight"][h, 0, di + 1, dj + 1]
                            dense[i, j] += weight * scores[i + di, j + dj]
        dense = np.exp(dense + bias)
        dense /= dense.sum(axis=1, keepdims=True)
        biased = scores + bias
        if layer.sparsifier == "softmax":
            sparse = np.exp(biased) / np.exp(biased).sum(axis=1, keepdims=True)
        else:
            power = 2 if layer.sparsifier == "relu2" else 1
            sparse = np.maximum(biased, 0) ** power / num_points
        heads.append((alpha[0] * sparse + alpha[1] * dense) @ v)
    y = x + np.concatenate(heads, axis=1) @ p["out.weight"].T + p["out.bias"]
    y = (y - y.mean(axis=1, keepdims=True)) / np.sqrt(y.var(axis=1, keepdims=True) + 1e-5)
    return y * p["norm.weight"] + p["norm.bias"]


@pytest.mark.parametrize("sparsifier", ["relu2", "relu", "softmax"])
def test_layer_equals_the_equations(sparsifier: Any) -> None:
    layer = _layer(sparsifier, is_random=True)
    x, basis, mask = _inputs()
    expected = _naive(layer, x[0].double().numpy(), basis[0].double().numpy())
    np.testing.assert_allclose(layer(x, basis, mask)[0].detach().numpy(), expected, atol=2e-5)


def test_alpha_starts_equal_and_sums_to_one() -> None:
    layer = _layer()
    assert layer.alpha.tolist() == [0.5, 0.5]
    with torch.no_grad():
        layer.beta.copy_(torch.tensor([1.5, -2.0]))
    assert layer.alpha.sum().item() == pytest.approx(1.0)
    assert layer.alpha[0] > layer.alpha[1]


def test_dense_branch_starts_as_plain_softmax() -> None:
    layer = _layer()
    _, basis, mask = _inputs()
    scores = torch.randn(1, HEADS, POINTS, POINTS, generator=torch.Generator().manual_seed(2))
    bias = layer.bias(basis)
    assert not bias.any()
    dense = dense_weights(scores, bias, layer.conv, mask)
    torch.testing.assert_close(dense, scores.softmax(dim=-1))


@pytest.mark.parametrize("sparsifier", ["relu2", "relu", "softmax"])
def test_padding_changes_nothing(sparsifier: Any) -> None:
    layer = _layer(sparsifier, is_random=True)
    x, basis, mask = _inputs(num_padding=3)
    padded = layer(x, basis, mask)[:, :-3]
    real = layer(x[:, :-3], basis[:, :, :-3, :-3], mask[:, :-3])
    torch.testing.assert_close(padded, real, rtol=0, atol=1e-5)


def test_weights_of_padding_are_zero() -> None:
    scores = torch.randn(1, HEADS, POINTS, POINTS, generator=torch.Generator().manual_seed(2))
    _, _, mask = _inputs(num_padding=2)
    zero = torch.zeros_like(scores)
    dense = dense_weights(scores, zero, _layer(is_random=True).conv, mask)
    torch.testing.assert_close(dense.sum(dim=-1), torch.ones(1, HEADS, POINTS))
    for weights in (dense, sparse_weights(scores, zero, mask, "relu2")):
        assert not weights[..., -2:].any()


def test_sparse_branch_drops_negative_scores() -> None:
    scores = torch.tensor([[[[-1.0, 2.0], [3.0, -4.0]]]])
    mask = torch.ones(1, 2, dtype=torch.bool)
    weights = sparse_weights(scores, torch.zeros_like(scores), mask, "relu2")
    assert weights.tolist() == [[[[0.0, 2.0], [4.5, 0.0]]]]


def test_position_basis_is_relative_and_bounded() -> None:
    positions = torch.rand(2, 6, 3, generator=torch.Generator().manual_seed(0)) * 2 - 1
    basis = position_basis(positions, SCALES)
    assert basis.shape == (2, SCALES + 3, 6, 6)
    assert basis.abs().max() <= 1
    torch.testing.assert_close(position_basis(positions + 0.25, SCALES), basis, rtol=0, atol=2e-5)
    radial, signed = basis[:, :SCALES], basis[:, SCALES:]
    torch.testing.assert_close(radial, radial.transpose(2, 3))
    torch.testing.assert_close(signed, -signed.transpose(2, 3))
    assert (radial.diagonal(dim1=2, dim2=3) == 1).all()


def test_position_bias_starts_at_zero_and_learns() -> None:
    bias = RelativePositionBias(HEADS, SCALES)
    _, basis, _ = _inputs()
    out = bias(basis)
    assert not out.any()
    out[0, 0, 0, 1].backward()
    assert bias.weight.grad is not None and bias.weight.grad[0].any()
