"""RGB-D views and an instruction in, a cloud with CLIP features in text space out.

    from perception import MultiViewLifter, fit_config, load_encoder, read_views

    views = read_views("my_views")
    scene = MultiViewLifter(load_encoder(), fit_config(views)).lift(views)
    print(scene.query("red mug").point)

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
    from perception.fitting import fit_config
    from perception.fusion import FusionConfig, fuse
    from perception.language import Instruction, parse_instruction
    from perception.lifter import LifterConfig, MultiViewLifter, Percept
    from perception.lifting import LiftingConfig, lift_features
    from perception.readers import read_pair, read_views
    from perception.readers.folder import save_views
    from perception.readers.frames import ReadOptions
    from perception.scene import Answer, LiftedScene
    from perception.segments import SegmentConfig, find_segments
    from perception.text_scores import TextScorer
    from perception.views import CameraView, Intrinsics
    from perception.voxels import reduce_cloud

_MODULE_OF = {
    "Answer": "scene",
    "CameraView": "views",
    "Encoder": "encoders.base",
    "FeatureCloud": "cloud",
    "FusionConfig": "fusion",
    "GeometryCloud": "cloud",
    "Instruction": "language",
    "Intrinsics": "views",
    "LiftedScene": "scene",
    "LifterConfig": "lifter",
    "LiftingConfig": "lifting",
    "MultiViewLifter": "lifter",
    "Percept": "lifter",
    "PerceptionError": "errors",
    "ReadOptions": "readers.frames",
    "SegmentConfig": "segments",
    "TextFeatures": "encoders.base",
    "TextScorer": "text_scores",
    "available_encoders": "encoders",
    "encoder_weights_status": "encoders",
    "find_segments": "segments",
    "fit_config": "fitting",
    "fuse": "fusion",
    "lift_features": "lifting",
    "load_encoder": "encoders",
    "parse_instruction": "language",
    "read_pair": "readers",
    "read_views": "readers",
    "reduce_cloud": "voxels",
    "save_views": "readers.folder",
}

__all__ = [
    "Answer",
    "CameraView",
    "Encoder",
    "FeatureCloud",
    "FusionConfig",
    "GeometryCloud",
    "Instruction",
    "Intrinsics",
    "LiftedScene",
    "LifterConfig",
    "LiftingConfig",
    "MultiViewLifter",
    "Percept",
    "PerceptionError",
    "ReadOptions",
    "SegmentConfig",
    "TextFeatures",
    "TextScorer",
    "available_encoders",
    "encoder_weights_status",
    "find_segments",
    "fit_config",
    "fuse",
    "lift_features",
    "load_encoder",
    "parse_instruction",
    "read_pair",
    "read_views",
    "reduce_cloud",
    "save_views",
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
