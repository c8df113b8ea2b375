"""RGB-D views and an instruction in, a cloud with CLIP features in text space out.

    from perception import MultiViewLifter, load_encoder

    lifter = MultiViewLifter(load_encoder("embedded"))
    percept = lifter.perceive(views, "give me the pear")

The package stands alone: it knows nothing of simulators, robots or policies. Names are imported on
first use, since Open3D, torch and open_clip take seconds to import.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from perception.cloud import FeatureCloud, GeometryCloud
    from perception.encoders import available_encoders, encoder_weights_status, load_encoder
    from perception.encoders.base import Encoder, TextFeatures
    from perception.errors import PerceptionError
    from perception.fusion import FusionConfig, fuse
    from perception.language import Instruction, parse_instruction
    from perception.lifter import LifterConfig, MultiViewLifter, Percept
    from perception.lifting import LiftingConfig, lift_features
    from perception.views import CameraView, Intrinsics

_MODULE_OF = {
    "CameraView": "views",
    "Encoder": "encoders.base",
    "FeatureCloud": "cloud",
    "FusionConfig": "fusion",
    "GeometryCloud": "cloud",
    "Instruction": "language",
    "Intrinsics": "views",
    "LifterConfig": "lifter",
    "LiftingConfig": "lifting",
    "MultiViewLifter": "lifter",
    "Percept": "lifter",
    "PerceptionError": "errors",
    "TextFeatures": "encoders.base",
    "available_encoders": "encoders",
    "encoder_weights_status": "encoders",
    "fuse": "fusion",
    "lift_features": "lifting",
    "load_encoder": "encoders",
    "parse_instruction": "language",
}

__all__ = [
    "CameraView",
    "Encoder",
    "FeatureCloud",
    "FusionConfig",
    "GeometryCloud",
    "Instruction",
    "Intrinsics",
    "LifterConfig",
    "LiftingConfig",
    "MultiViewLifter",
    "Percept",
    "PerceptionError",
    "TextFeatures",
    "available_encoders",
    "encoder_weights_status",
    "fuse",
    "lift_features",
    "load_encoder",
    "parse_instruction",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'perception' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"perception.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
