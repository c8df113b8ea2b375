"""What the robot faces before it decides: what it sees, and what it could do about it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from perception.cloud import GeometryCloud
from perception.errors import EmptyCloudError
from perception.lifter import Percept
from perception.views import CameraView
from policy.actions import ActionCandidates
from sr_mj.attempt import Stopwatch
from sr_mj.candidates.held import HeldObject
from sr_mj.instruction import PhaseText
from sr_mj.pipeline import EpisodeRngs, Pipeline, look
from sr_mj.scene import Scene

DescribeHeld = Callable[[GeometryCloud], HeldObject]
Propose = Callable[[GeometryCloud, HeldObject | None], ActionCandidates]


@dataclass(frozen=True, kw_only=True, eq=False)
class Situation:
    """Everything that precedes a decision.

    Attributes:
        text: What the instruction says about this phase.
        views: What the cameras saw.
        percept: What was made of it, its features being those in the phase's zone if there is one;
            None if no object was in sight there.
        proposed: All actions that were proposed; None if there was no percept.
        candidates: Those among them that the policy may choose.
        held: What is in the gripper, as far as it was seen; for placing only.
        seconds: Wall time of each stage.
    """

    text: PhaseText
    views: tuple[CameraView, ...]
    percept: Percept | None = None
    proposed: ActionCandidates | None = None
    candidates: ActionCandidates | None = None
    held: HeldObject | None = None
    seconds: dict[str, float]


def assess(
    scene: Scene,
    pipeline: Pipeline,
    rngs: EpisodeRngs,
    text: PhaseText,
    propose: Propose,
    describe_held: DescribeHeld | None = None,
) -> Situation:
    """Look, perceive, propose, and leave out what the arm cannot reach.

    Args:
        scene: The scene.
        pipeline: The stages; its policy is not asked.
        rngs: Sensor noise and candidates are drawn from it.
        text: What the instruction says about this phase.
        propose: Makes candidates from the cloud and what is held.
        describe_held: Tells what is held, from the cloud; None if nothing is.

    Returns:
        What there is to decide.
    """
    watch, zone = Stopwatch(), scene.zone(text.phase)
    with watch.measure("look"):
        views = look(scene, pipeline, rngs.noise)
    try:
        with watch.measure("perceive"):
            percept = pipeline.lifter.perceive(views, text.text, unwanted=text.unwanted)
    except EmptyCloudError:
        return Situation(text=text, views=views, seconds=watch.seconds)
    if zone is not None:
        # Obstacles are everywhere, what the sentence is about in this phase's zone only.
        is_inside = zone.contains_xy(percept.features.points)
        if not is_inside.any():
            return Situation(text=text, views=views, seconds=watch.seconds)
        percept = replace(percept, features=percept.features.take(is_inside))
    with watch.measure("propose"):
        held = None if describe_held is None else describe_held(percept.geometry)
        proposed = propose(percept.geometry, held)
    with watch.measure("reach"):
        candidates = _reachable(pipeline, proposed)
    return Situation(
        text=text,
        views=views,
        percept=percept,
        proposed=proposed,
        candidates=candidates,
        held=held,
        seconds=watch.seconds,
    )


def _reachable(pipeline: Pipeline, proposed: ActionCandidates) -> ActionCandidates:
    if pipeline.keep_unreachable or not len(proposed):
        return proposed
    return proposed.take(np.flatnonzero(pipeline.planner.reachable(proposed)))
