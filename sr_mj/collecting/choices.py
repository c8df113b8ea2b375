"""What the expert sees, and what it makes of a goal."""

from dataclasses import dataclass

import numpy as np

from perception.lifter import Percept
from perception.views import CameraView
from policy.actions import ActionCandidates
from sr_mj.candidates.held import HeldObject
from sr_mj.instruction import PhaseText
from sr_mj.scene import Goal, Scene
from sr_mj.scene.placement import find_object


@dataclass(frozen=True, kw_only=True, eq=False)
class Seen:
    """One look, and what could be done after it.

    Attributes:
        views: What the cameras saw.
        percept: What was made of it, with respect to no instruction in particular.
        candidates: Actions that the arm can reach, for whatever goal.
        avoid_collision: (K,) float32, 1 where a detour is needed.
        held: What is in the gripper, for placing only.
    """

    views: tuple[CameraView, ...]
    percept: Percept
    candidates: ActionCandidates
    avoid_collision: np.ndarray
    held: HeldObject | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Choice:
    """What the expert makes of a goal, before anything is executed.

    Attributes:
        scene: The scene with that goal; if what is in the way has to be taken away first, with that
            as its target.
        logits: (K,) float32 the expert's scores.
        valid: (K,) whether a candidate does what is asked for, or, if none does and this clears,
            closes on what is in the way.
        objects: Names in the catalogue of what the instruction means in this phase.
        clears: Whether no candidate does what is asked for.
    """

    scene: Scene
    logits: np.ndarray
    valid: np.ndarray
    objects: tuple[str, ...]
    clears: bool = False

    @property
    def order(self) -> np.ndarray:
        """Indices of the valid candidates, best first."""
        order = np.argsort(-self.logits, kind="stable")
        return order[self.valid[order]]


def meant_objects(scene: Scene, goal: Goal, text: PhaseText) -> tuple[str, ...]:
    """List what an instruction means in its phase.

    Args:
        scene: The scene.
        goal: Its goal.
        text: What is said of the phase.

    Returns:
        Names in the catalogue, each once: of what may be picked, or of what it may be placed by.
    """
    names = goal.targets
    if text.phase == "place":
        names = () if goal.place is None else goal.place.references
    return tuple(sorted({find_object(scene, name).asset.name for name in names}))
