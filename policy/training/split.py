"""Which scenes and objects are trained on and which are held out."""

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
        new: Held out; they mean objects that nothing in `train` or `val` means.
    """

    train: np.ndarray
    val: np.ndarray
    new: np.ndarray


def name_fraction(name: str, purpose: str) -> float:
    """Map a name to a number that depends on nothing else.

    Args:
        name: Name of a scene or of an object.
        purpose: Different purposes give independent numbers.

    Returns:
        A number from 0 to below 1, evenly distributed over names.
    """
    digest = hashlib.sha256(f"{purpose}|{name}".encode()).digest()
    return int.from_bytes(digest[:6], "big") / 2**48


def split_demonstrations(
    scenes: Sequence[str],
    objects: Sequence[Sequence[str]],
    *,
    val_share: float,
    train_share: float = 1.0,
    new_share: float = 0.0,
) -> Split:
    """Split demonstrations so that those of one scene, and those of one object, stay together.

    Args:
        scenes: Scene of every demonstration.
        objects: Objects that every demonstration's instruction means.
        val_share: Share of scenes to hold out.
        train_share: Share of the other scenes to use.
        new_share: Share of objects to hold out: whatever means one of them, in whatever scene.

    Returns:
        The split. Adding demonstrations moves no other.

    Raises:
        InvalidDemonstrationsError: If nothing is left to train on or to validate with, or no
            demonstration means an object that was to be held out.
    """
    held_out = {scene for scene in set(scenes) if name_fraction(scene, "split") < val_share}
    used = {
        scene for scene in set(scenes) - held_out if name_fraction(scene, "share") < train_share
    }
    is_new = np.array(
        [any(name_fraction(name, "object") < new_share for name in names) for names in objects]
    )
    train = np.flatnonzero([scene in used for scene in scenes] & ~is_new)
    val = np.flatnonzero([scene in held_out for scene in scenes] & ~is_new)
    new = np.flatnonzero(is_new)
    if not (len(train) and len(val)):
        raise InvalidDemonstrationsError(
            f"data: got {len(set(scenes))} scenes, {len(used)} for training and {len(held_out)} "
            f"for validation at val_share={val_share:g}, expected at least 1 of each. Collect more "
            "scenes, or change --val-share."
        )
    if new_share and not len(new):
        raise InvalidDemonstrationsError(
            f"data: got no demonstration that means one of the objects held out at "
            f"new_share={new_share:g}, expected at least 1. Raise --new-share, or collect more."
        )
    return Split(train=train, val=val, new=new)
