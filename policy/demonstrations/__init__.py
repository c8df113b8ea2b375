"""What an expert did: decisions with all that is needed to learn from them, and their files.

The public names are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from policy.demonstrations.decision import Decision, Demonstration, Look, Wording
    from policy.demonstrations.folder import DemonstrationFolder
    from policy.demonstrations.layout import SCHEMA_VERSION
    from policy.demonstrations.shard import Shard, read_shard, write_shard

_HOMES = {
    "SCHEMA_VERSION": "layout",
    "Decision": "decision",
    "Demonstration": "decision",
    "DemonstrationFolder": "folder",
    "Look": "decision",
    "Shard": "shard",
    "Wording": "decision",
    "read_shard": "shard",
    "write_shard": "shard",
}

__all__ = [
    "SCHEMA_VERSION",
    "Decision",
    "Demonstration",
    "DemonstrationFolder",
    "Look",
    "Shard",
    "Wording",
    "read_shard",
    "write_shard",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'policy.demonstrations' has no attribute {name!r}")
    return getattr(import_module(f"policy.demonstrations.{_HOMES[name]}"), name)
