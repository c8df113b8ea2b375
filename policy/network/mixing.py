"""Weights that mix scores, which can learn at a rate of their own."""

from torch import nn


class MixingModule(nn.Module):
    """A module whose own parameters, not those of its parts, weigh scores against each other.

    They matter at the size of a score, 1 to 10, an entry of a projection at that of 0.1. Adam's
    steps are as large as the learning rate whatever the gradient: what suits a projection hardly
    moves such a weight in a whole training.
    """


def mixing_weights(network: nn.Module) -> dict[str, nn.Parameter]:
    """Find the mixing weights of a network.

    Args:
        network: Any network.

    Returns:
        Them by name, in the network's order.
    """
    return {
        f"{prefix}.{name}": parameter
        for prefix, module in network.named_modules()
        if isinstance(module, MixingModule)
        for name, parameter in module.named_parameters(recurse=False)
    }
