"""Scenes: what is on the table, where, and what is asked for.

Names are imported on first use: the registry answers without loading MuJoCo.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sr_mj.scene.build import Scene, SceneObject, make_scene
    from sr_mj.scene.config import SCENE_KINDS, SPLITS, SceneConfig, SceneKind, scene_config
    from sr_mj.scene.goals import Goal, PlaceGoal, find_goal, find_targets

_MODULE_OF = {
    "SCENE_KINDS": "config",
    "SPLITS": "config",
    "Goal": "goals",
    "PlaceGoal": "goals",
    "Scene": "build",
    "SceneConfig": "config",
    "SceneKind": "config",
    "SceneObject": "build",
    "find_goal": "goals",
    "find_targets": "goals",
    "make_scene": "build",
    "scene_config": "config",
}

__all__ = [
    "SCENE_KINDS",
    "SPLITS",
    "Goal",
    "PlaceGoal",
    "Scene",
    "SceneConfig",
    "SceneKind",
    "SceneObject",
    "find_goal",
    "find_targets",
    "make_scene",
    "scene_config",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'sr_mj.scene' has no attribute {name!r}")
    return getattr(importlib.import_module(f"sr_mj.scene.{_MODULE_OF[name]}"), name)
