"""Which scenes are trained on and which are held out."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from policy.errors import InvalidDemonstrationsError


@dataclass(frozen=True, kw_only=True, eq=False)
class Split:
    """Indices of demonstrations, ascending.

    Attributes:
        train: To learn from.
        val: Held out; of other scenes.
    """

    train: np.ndarray
    val: np.ndarray


def scene_fraction(scene: str, purpose: str) -> float:
    """Map a scene to a number that depends on nothing but its name.

    Args:
        scene: Name of the scene.
        purpose: Different purposes give independent numbers.

    Returns:
        A number from 0 to below 1, evenly distributed over names.
    """
    digest = hashlib.sha256(f"{purpose}|{scene}".encode()).digest()
    return int.from_bytes(digest[:6], "big") / 2**48


def split_by_scene(scenes: Sequence[str], *, val_share: float, train_share: float = 1.0) -> Split:
    """Split demonstrations so that those of one scene stay together.

    Args:
        scenes: Scene of every demonstration.
        val_share: Share of scenes to hold out.
        train_share: Share of the other scenes to use.

    Returns:
        The split. Adding scenes moves no other scene.

    Raises:
        InvalidDemonstrationsError: If one of the two sides is empty.
    """
    held_out = {scene for scene in set(scenes) if scene_fraction(scene, "split") < val_share}
    used = {
        scene for scene in set(scenes) - held_out if scene_fraction(scene, "share") < train_share
    }
    train = np.flatnonzero([scene in used for scene in scenes])
    val = np.flatnonzero([scene in held_out for scene in scenes])
    if not (len(train) and len(val)):
        raise InvalidDemonstrationsError(
            f"data: got {len(set(scenes))} scenes, {len(used)} for training and {len(held_out)} "
            f"for validation at val_share={val_share:g}, expected at least 1 of each. Collect more "
            "scenes, or change --val-share."
        )
    return Split(train=train, val=val)
