"""Scenes: what is on the table, where, and what is asked for."""

from sr_mj.scene.build import Scene, SceneObject, make_scene
from sr_mj.scene.config import SCENE_KINDS, SPLITS, SceneConfig, SceneKind
from sr_mj.scene.goals import Goal, find_targets

__all__ = [
    "SCENE_KINDS",
    "SPLITS",
    "Goal",
    "Scene",
    "SceneConfig",
    "SceneKind",
    "SceneObject",
    "find_targets",
    "make_scene",
]
