import math
from typing import Any

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from policy.network.bias import (
    CandidateBias,
    RelativePositionBias,
    bias_scales,
    candidate_basis,
    position_basis,
    rotation_matrices,
)
from policy.network.dssa import DSSALayer, convolved_factors, sparsify

WIDTH, HEADS, SCALES, POINTS = 16, 4, 3, 9


def _layer(sparsifier: Any = "relu2", *, is_random: bool = False) -> DSSALayer:
    torch.manual_seed(0)
    layer = DSSALayer(WIDTH, HEADS, SCALES, sparsifier).double()
    if is_random:
        with torch.no_grad():
            for parameter in layer.parameters():
                parameter.copy_(torch.randn_like(parameter) * 0.5)
    return layer


def _inputs(num_padding: int = 0) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    x = torch.randn(1, POINTS, WIDTH, generator=generator, dtype=torch.float64)
    positions = torch.rand(1, POINTS, 3, generator=generator, dtype=torch.float64) * 2 - 1
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
    expected = _naive(layer, x[0].numpy(), basis[0].numpy())
    np.testing.assert_allclose(layer(x, basis, mask)[0].detach().numpy(), expected, atol=1e-10)


def test_alpha_starts_equal_and_sums_to_one() -> None:
    layer = _layer()
    assert layer.alpha.tolist() == [0.5, 0.5]
    with torch.no_grad():
        layer.beta.copy_(torch.tensor([1.5, -2.0]))
    assert layer.alpha.sum().item() == pytest.approx(1.0)
    assert layer.alpha[0] > layer.alpha[1]


def test_branches_and_their_weights_receive_gradients() -> None:
    layer = _layer(is_random=True)
    layer(*_inputs()).square().sum().backward()
    for parameter in (layer.beta, layer.conv.weight, layer.bias.weight, layer.query.weight):
        assert parameter.grad is not None and (parameter.grad != 0).all()


def test_gradients_are_those_of_the_function() -> None:
    layer = _layer(is_random=True)
    x, basis, mask = _inputs(num_padding=2)
    names = [name for name, _ in layer.named_parameters()]

    def run(x: torch.Tensor, *parameters: torch.Tensor) -> torch.Tensor:
        named = dict(zip(names, parameters, strict=True))
        return torch.func.functional_call(layer, named, (x, basis, mask))[:, :-2]

    parameters = [parameter.detach().requires_grad_() for parameter in layer.parameters()]
    # Fast mode checks the same numbers along random directions.
    assert torch.autograd.gradcheck(run, (x.requires_grad_(), *parameters), fast_mode=True)


def test_convolution_of_the_score_map_is_a_longer_product() -> None:
    generator = torch.Generator().manual_seed(2)
    q, k = torch.randn(2, 3, HEADS, POINTS, 5, generator=generator, dtype=torch.float64)
    conv = _layer(is_random=True).conv
    left, right = convolved_factors(q, k, conv.weight)
    assert left.shape == right.shape == (3, HEADS, POINTS, 15)
    torch.testing.assert_close(left @ right.transpose(2, 3), conv(q @ k.transpose(2, 3)))


def test_dense_branch_starts_as_plain_softmax() -> None:
    layer = _layer()
    x, basis, mask = _inputs()
    with torch.no_grad():
        layer.beta.copy_(torch.tensor([-60.0, 60.0]))
        q, k, v = (f(x).unflatten(-1, (HEADS, -1)) for f in (layer.query, layer.key, layer.value))
        scores = torch.einsum("bihd,bjhd->bhij", q, k) / math.sqrt(WIDTH // HEADS)
        y = torch.einsum("bhij,bjhd->bihd", scores.softmax(dim=-1), v).flatten(2)
        torch.testing.assert_close(layer(x, basis, mask), layer.norm(x + layer.out(y)))


@pytest.mark.parametrize("sparsifier", ["relu2", "relu", "softmax"])
def test_padding_changes_nothing(sparsifier: Any) -> None:
    layer = _layer(sparsifier, is_random=True)
    x, basis, mask = _inputs(num_padding=3)
    padded = layer(x, basis, mask)[:, :-3]
    real = layer(x[:, :-3], basis[:, :, :-3, :-3], mask[:, :-3])
    torch.testing.assert_close(padded, real, rtol=0, atol=1e-10)


@pytest.mark.parametrize("sparsifier", ["relu2", "relu", "softmax"])
def test_a_cloud_of_padding_only_stays_finite(sparsifier: Any) -> None:
    layer = _layer(sparsifier, is_random=True)
    x, basis, mask = _inputs(num_padding=POINTS)
    torch.testing.assert_close(layer(x, basis, mask), layer.norm(x + layer.out.bias))


def test_sparse_branch_gives_exact_zeros() -> None:
    biased = torch.tensor([[[[-1.0, 2.0], [3.0, -0.0]]]])
    assert sparsify(biased, "relu2").tolist() == [[[[0.0, 4.0], [9.0, 0.0]]]]
    assert sparsify(biased, "relu").tolist() == [[[[0.0, 2.0], [3.0, 0.0]]]]
    scores = torch.randn(1, HEADS, POINTS, POINTS, generator=torch.Generator().manual_seed(2))
    assert torch.equal(sparsify(scores, "relu2") == 0, scores <= 0)
    assert (sparsify(scores, "softmax") > 0).all()


def test_position_basis_is_relative_and_bounded() -> None:
    positions = torch.rand(2, 6, 3, generator=torch.Generator().manual_seed(0)).double() * 2 - 1
    basis = position_basis(positions, SCALES)
    assert basis.shape == (2, SCALES + 3, 6, 6)
    assert basis.abs().max() <= 1
    torch.testing.assert_close(position_basis(positions + 0.25, SCALES), basis)
    radial, signed = basis[:, :SCALES], basis[:, SCALES:]
    torch.testing.assert_close(radial, radial.transpose(2, 3))
    torch.testing.assert_close(signed, -signed.transpose(2, 3))
    assert (radial.diagonal(dim1=2, dim2=3) == 1).all()


def test_position_bias_starts_at_zero_and_learns() -> None:
    bias = RelativePositionBias(HEADS, SCALES).double()
    _, basis, _ = _inputs()
    out = bias(basis)
    assert not out.any()
    out[0, 0, 0, 1].backward()
    assert bias.weight.grad is not None and bias.weight.grad[0].any()


def _poses_and_points() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(4)
    poses = torch.randn(2, 3, 7, generator=generator, dtype=torch.float64)
    poses[..., 3:] /= poses[..., 3:].norm(dim=-1, keepdim=True)
    return poses, torch.rand(2, 6, 3, generator=generator, dtype=torch.float64) * 2 - 1


def test_rotation_matrices_equal_scipy() -> None:
    quat = _poses_and_points()[0][0, :, 3:]
    expected = Rotation.from_quat(quat.numpy()).as_matrix()
    np.testing.assert_allclose(rotation_matrices(quat).numpy(), expected, atol=1e-12)
    assert torch.equal(rotation_matrices(torch.zeros(1, 4))[0], torch.eye(3))


def test_candidate_basis_equals_its_definition() -> None:
    poses, points = _poses_and_points()
    basis = candidate_basis(poses, points, torch.tensor([False, True]), SCALES)
    assert basis.shape == (2, SCALES + 4, 3, 6)
    for b, k, i in np.ndindex(2, 3, 6):
        delta = (points[b, i] - poses[b, k, :3]).numpy()
        distance = np.linalg.norm(delta[:2] if b else delta)
        expected = [1 / (1 + (distance / s) ** 2) for s in bias_scales(SCALES)]
        tool = Rotation.from_quat(poses[b, k, 3:].numpy()).inv().apply(delta)
        expected += [abs(t) / (0.1 + abs(t)) for t in tool] + [tool[2] / (0.1 + abs(tool[2]))]
        np.testing.assert_allclose(basis[b, :, k, i].numpy(), expected, atol=1e-12)


def test_a_half_turn_of_the_gripper_changes_no_bias() -> None:
    poses, points = _poses_and_points()
    turned = poses.clone()
    half = Rotation.from_euler("z", 180, degrees=True)
    for b in range(2):
        turn = Rotation.from_quat(poses[b, :, 3:].numpy()) * half
        turned[b, :, 3:] = torch.from_numpy(turn.as_quat())
    is_place = torch.tensor([False, True])
    expected = candidate_basis(poses, points, is_place, SCALES)
    torch.testing.assert_close(candidate_basis(turned, points, is_place, SCALES), expected)


def test_candidate_bias_differs_by_phase() -> None:
    bias = CandidateBias(4, HEADS, SCALES)
    poses, points = (x.float() for x in _poses_and_points())
    basis = candidate_basis(poses, points, torch.tensor([False, True]), SCALES)
    out = bias(basis, torch.tensor([0, 2]))
    assert (out[:, : HEADS // 2] > 0).all() and not out[:, HEADS // 2 :].any()
    out[0].sum().backward()
    assert bias.weight.grad is not None
    assert bias.weight.grad[0].any() and not bias.weight.grad[1:].any()
