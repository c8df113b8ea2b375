"""Weights that a few large things are mixed with, which have to learn faster than the others."""

from torch import nn


class MixingModule(nn.Module):
    """A module whose own parameters, not those of its parts, weigh scores against each other.

    They are of the size of a score, 1 to 10, while an entry of a projection is of the size of
    0.1. Adam's steps are as large as the learning rate whatever the gradient: what suits a
    projection hardly moves such a weight in a whole training.
    """


def mixing_weights(network: nn.Module) -> dict[str, nn.Parameter]:
    """Find the mixing weights of a network.

    Args:
        network: Any network.

    Returns:
        They by name, in the network's order.
    """
    return {
        f"{prefix}.{name}": parameter
        for prefix, module in network.named_modules()
        if isinstance(module, MixingModule)
        for name, parameter in module.named_parameters(recurse=False)
    }
