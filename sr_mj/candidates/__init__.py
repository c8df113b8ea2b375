"""Grasp candidates: the generator protocol, and the geometric antipodal sampler.

Names are imported on first use, so that the configuration can be read without loading torch.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sr_mj.candidates.antipodal import AntipodalSampler
    from sr_mj.candidates.config import AntipodalConfig, Relaxation
    from sr_mj.candidates.generator import CandidateGenerator

_MODULE_OF = {
    "AntipodalConfig": "config",
    "AntipodalSampler": "antipodal",
    "CandidateGenerator": "generator",
    "Relaxation": "config",
}

__all__ = ["AntipodalConfig", "AntipodalSampler", "CandidateGenerator", "Relaxation"]


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'sr_mj.candidates' has no attribute {name!r}")
    return getattr(importlib.import_module(f"sr_mj.candidates.{_MODULE_OF[name]}"), name)
