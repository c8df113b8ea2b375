"""Network and loss as one module, and the arithmetic they run in."""

from typing import NamedTuple

import torch
from torch import Tensor, nn

from policy.network.base import CandidateNetwork
from policy.network.decoder import NetworkOutput
from policy.network.loss import choice_loss, decoding_loss
from policy.training.config import Precision
from policy.training.draws import ExampleBatch


class Terms(NamedTuple):
    """What one batch gives; every entry is a mean over its decisions.

    Attributes:
        loss: The objective.
        choice: Cross-entropy of the choice, eq. (15).
        decoding: Loss of the action parameters, without its weight.
        valid: Cross-entropy with every valid candidate as right, for picks too.
        top1: Share of decisions whose best candidate is valid.
    """

    loss: Tensor
    choice: Tensor
    decoding: Tensor
    valid: Tensor
    top1: Tensor


class Objective(nn.Module):
    """Scores a batch and compares it with its targets; one forward pass, as DDP wants it."""

    def __init__(
        self, network: CandidateNetwork, decoding_weight: float, dtype: torch.dtype
    ) -> None:
        """Wrap a network.

        Args:
            network: What is trained.
            decoding_weight: Weight of the action parameters in the loss.
            dtype: float32, or bfloat16 for autocast.
        """
        super().__init__()
        self.network = network
        self.decoding_weight = decoding_weight
        self.dtype = dtype

    def forward(self, batch: ExampleBatch) -> Terms:
        """Compute loss and metrics of a batch.

        Args:
            batch: B examples.

        Returns:
            The terms; only `loss` carries a gradient.
        """
        output = self.score(batch)
        choice = choice_loss(output.logits, batch.targets.positive)
        decoding = decoding_loss(output, batch.targets, self.network.config)
        with torch.no_grad():
            valid = choice_loss(output.logits, batch.valid)
            best = output.logits.argmax(dim=1, keepdim=True)
            top1 = batch.valid.gather(1, best).float().mean()
        loss = choice + self.decoding_weight * decoding
        return Terms(loss, choice.detach(), decoding.detach(), valid, top1)

    def score(self, batch: ExampleBatch) -> NetworkOutput:
        """Run the network; losses are computed in single precision whatever it runs in.

        Args:
            batch: B examples.

        Returns:
            Its output in float32.
        """
        device = batch.valid.device.type
        with torch.autocast(device, torch.bfloat16, enabled=self.dtype == torch.bfloat16):
            output = self.network(batch.inputs)
        return NetworkOutput(
            logits=output.logits.float(),
            rotvec_tool=output.rotvec_tool.float(),
            opening_m=output.opening_m.float(),
            avoid_collision_logit=output.avoid_collision_logit.float(),
        )


def compute_dtype(precision: Precision, device: str) -> torch.dtype:
    """Choose the network's arithmetic.

    Args:
        precision: What was asked for.
        device: cpu or cuda.

    Returns:
        float32 or bfloat16. On processors that do not multiply bfloat16, it is slower than
        float32, so "auto" leaves it out there.
    """
    if precision != "auto":
        return torch.float32 if precision == "float32" else torch.bfloat16
    is_fast = (
        torch.cuda.is_bf16_supported()
        if device == "cuda"
        else torch.cpu._is_avx512_bf16_supported()
    )
    return torch.bfloat16 if is_fast else torch.float32
