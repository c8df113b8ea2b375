"""Choosing among candidate actions: containers, baselines and the SR network.

The public names are imported on first use, because torch takes seconds to load.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from policy.actions import ActionCandidates, ActionDecoding, ActionScores
    from policy.base import Policy
    from policy.errors import PolicyError
    from policy.observation import Observation
    from policy.registry import POLICY_NAMES, load_policy

_HOMES = {
    "ActionCandidates": "policy.actions",
    "ActionDecoding": "policy.actions",
    "ActionScores": "policy.actions",
    "Observation": "policy.observation",
    "POLICY_NAMES": "policy.registry",
    "Policy": "policy.base",
    "PolicyError": "policy.errors",
    "load_policy": "policy.registry",
}

__all__ = [
    "POLICY_NAMES",
    "ActionCandidates",
    "ActionDecoding",
    "ActionScores",
    "Observation",
    "Policy",
    "PolicyError",
    "load_policy",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'policy' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
