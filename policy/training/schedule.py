"""The learning rate over a run, and over the parts of a network."""

import math
from typing import Any

from torch import nn

from policy.network.mixing import mixing_weights
from policy.training.config import Schedule


def rate_factor(step: int, *, schedule: Schedule, warmup: int, num_steps: int) -> float:
    """Share of the highest learning rate that a step uses.

    Args:
        step: Number of the step, from 0.
        schedule: "constant" or "cosine".
        warmup: Steps over which it rises from zero.
        num_steps: Steps of the whole run; where the cosine reaches zero.

    Returns:
        Above 0, at most 1.
    """
    if step < warmup:
        return (step + 1) / warmup
    if schedule == "constant":
        return 1.0
    # The step after the last one would be at zero: every step that is made moves the weights.
    done = (step - warmup) / max(num_steps - warmup, 1)
    return 0.5 * (1 + math.cos(math.pi * min(done, 1.0)))


def rate_groups(network: nn.Module, mixing_rate: float) -> list[dict[str, Any]]:
    """Divide the parameters of a network by how fast they learn.

    Args:
        network: The network.
        mixing_rate: Rate of its mixing weights, as a multiple of that of the others.

    Returns:
        Groups for an optimizer; `factor` tells what to multiply its learning rate with.
    """
    mixing = mixing_weights(network)
    others = [p for name, p in network.named_parameters() if name not in mixing]
    return [
        {"params": others, "factor": 1.0},
        {"params": list(mixing.values()), "factor": mixing_rate},
    ]
