"""What is worth watching while the network learns."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import Tensor, nn

from policy.network.base import CandidateNetwork


def gradient_norms(network: CandidateNetwork) -> dict[str, float]:
    """Norm of the gradient of every part of the network.

    Args:
        network: After a backward pass.

    Returns:
        `grad_PART` for each of its modules that has parameters.
    """
    norms = {}
    for name, part in network.named_children():
        gradients = [p.grad for p in part.parameters() if p.grad is not None]
        if gradients:
            norms[f"grad_{name}"] = float(nn.utils.get_total_norm(gradients))
    return norms


def branch_weights(network: CandidateNetwork) -> dict[str, float]:
    """Weight of the sparse branch in every DSSA layer; the dense one has the rest.

    Args:
        network: The network, of any kind.

    Returns:
        `alpha_sparse_LAYER`, layers counted from 0.
    """
    return {f"alpha_sparse_{i}": row[0] for i, row in enumerate(network.alpha().tolist())}


class GateEntropy:
    """Entropy of the semantic mask that the last forward pass made.

    Attributes:
        value: 1 for a mask that weighs all points alike, 0 for one that picks a single point; mean
            over decisions and heads. NaN before the first pass, or without a mask.
    """

    def __init__(self) -> None:
        """Start without a value."""
        self.value = math.nan

    @torch.no_grad()
    def __call__(self, module: nn.Module, args: tuple[Tensor, ...]) -> None:
        """Read the gate (B, H, N), of mean 1 over real points and 0 on padding."""
        gate = args[1].detach().float()
        num_points = gate.sum(dim=-1, keepdim=True).clamp(min=1e-6)
        share = gate / num_points
        entropy = -torch.special.xlogy(share, share).sum(dim=-1)
        self.value = float((entropy / num_points.squeeze(-1).clamp(min=2).log()).mean())


@contextmanager
def gate_entropy(network: CandidateNetwork) -> Iterator[GateEntropy]:
    """Watch the semantic mask of stage 1, in networks that have one.

    Args:
        network: The network, of any kind.

    Yields:
        The entropy, renewed by every forward pass.
    """
    entropy = GateEntropy()
    stage = network.masking
    if stage is None:
        yield entropy
        return
    handle = stage.register_forward_pre_hook(entropy)
    try:
        yield entropy
    finally:
        handle.remove()
