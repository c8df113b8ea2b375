"""Candidates for grasps and places: protocols, geometric samplers, learnt ones from elsewhere.

Names are imported on first use, so that the configuration can be read without loading torch.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sr_mj.candidates.antipodal import AntipodalSampler
    from sr_mj.candidates.config import AntipodalConfig, Relaxation
    from sr_mj.candidates.external import ExternalConfig, load_generator
    from sr_mj.candidates.generator import CandidateGenerator, PlaceGenerator
    from sr_mj.candidates.held import HeldObject, held_object
    from sr_mj.candidates.place_config import PlaceConfig
    from sr_mj.candidates.placing import SurfacePlacer

_MODULE_OF = {
    "AntipodalConfig": "config",
    "AntipodalSampler": "antipodal",
    "CandidateGenerator": "generator",
    "ExternalConfig": "external",
    "HeldObject": "held",
    "PlaceConfig": "place_config",
    "PlaceGenerator": "generator",
    "Relaxation": "config",
    "SurfacePlacer": "placing",
    "held_object": "held",
    "load_generator": "external",
}

__all__ = [
    "AntipodalConfig",
    "AntipodalSampler",
    "CandidateGenerator",
    "ExternalConfig",
    "HeldObject",
    "PlaceConfig",
    "PlaceGenerator",
    "Relaxation",
    "SurfacePlacer",
    "held_object",
    "load_generator",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'sr_mj.candidates' has no attribute {name!r}")
    return getattr(importlib.import_module(f"sr_mj.candidates.{_MODULE_OF[name]}"), name)
