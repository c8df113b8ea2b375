"""Kinds of networks by name."""

from importlib import import_module
from typing import TYPE_CHECKING

from policy.network.config import NetworkConfig

if TYPE_CHECKING:
    from policy.network.base import CandidateNetwork

# Imported on first use: torch takes seconds, and options are checked before.
_HOMES = {
    "sr": "policy.network.model.SRNetwork",
    "a2": "policy.baselines.a2.A2Network",
    "vlg": "policy.baselines.vlg.VLGNetwork",
}


def network_type(kind: str) -> "type[CandidateNetwork]":
    """Find the class of a kind of network.

    Args:
        kind: `kind` of its configuration.

    Returns:
        The class.
    """
    module, _, name = _HOMES[kind].rpartition(".")
    return getattr(import_module(module), name)


def make_network(config: NetworkConfig) -> "CandidateNetwork":
    """Make a network with random weights.

    Args:
        config: Its configuration, which says of what kind it is.

    Returns:
        The network.
    """
    return network_type(config.kind)(config)
