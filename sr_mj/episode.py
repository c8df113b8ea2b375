"""One episode: look, decide, act, look again, until the goal is met or the attempts are used up.

This is the one way through the system; command lines and evaluation only start it and read it.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from perception.cloud import GeometryCloud
from perception.errors import EmptyCloudError
from policy.actions import ActionCandidates
from sr_mj.attempt import Attempt, Stopwatch
from sr_mj.candidates.held import HeldObject, held_object
from sr_mj.instruction import PhaseText, names_target, pick_text, place_text
from sr_mj.memory import FailedGrasps
from sr_mj.oracle import OraclePolicy
from sr_mj.outcome import Outcome, Reason
from sr_mj.pipeline import EpisodeRngs, Pipeline, look, observe
from sr_mj.planning import Plan
from sr_mj.scene import Scene

_DescribeHeld = Callable[[GeometryCloud], HeldObject]

DEFAULT_ATTEMPTS = 8
PLACE_LOOKS = 3
"""How often is looked for a place to put something, while none that can be reached is found."""


def is_handed_over(scene: Scene) -> bool:
    """Tell whether a goal is to place something that is not named, but handed to the robot."""
    arranged = scene.config.arranged
    is_place_suite = arranged is not None and arranged.suite == "place"
    return scene.goal.place is not None and (is_place_suite or not names_target(scene.goal.text))


def has_succeeded(scene: Scene, attempts: list[Attempt]) -> bool:
    """Tell whether an episode met its goal: the last thing it asks for was done."""
    last = "pick" if scene.goal.place is None else "place"
    return bool(attempts) and attempts[-1].kind == last and attempts[-1].outcome.success


def run_episode(
    scene: Scene, pipeline: Pipeline, *, seed: int, max_attempts: int = DEFAULT_ATTEMPTS
) -> Iterator[Attempt]:
    """Act in a scene until an object of the target set is held, and put where it is asked for.

    Args:
        scene: The scene; its state changes.
        pipeline: The stages, made for this scene.
        seed: Draws sensor noise, candidates, what the policy draws, and errors of poses.
        max_attempts: Grasps after which the episode ends; placing is tried once.

    Yields:
        Every attempt as it ends; the last one tells how the episode ended. If the object to place
        is handed over, the oracle's attempts to pick it come first.
    """
    rngs = EpisodeRngs.from_seed(seed)
    picking, hand_over = pipeline, is_handed_over(scene)
    if hand_over:
        picking = replace(
            pipeline, policy=OraclePolicy(scene), perturbation=None, keep_unreachable=False
        )
    describe_held = None
    for attempt in _pick(scene, picking, rngs, max_attempts):
        yield replace(attempt, is_hand_over=hand_over)
        if attempt.outcome.success and scene.goal.place is not None:
            describe_held = _held_after(attempt, pipeline)
    if describe_held is not None:
        yield from _place(scene, pipeline, rngs, describe_held)


def _pick(
    scene: Scene, pipeline: Pipeline, rngs: EpisodeRngs, max_attempts: int
) -> Iterator[Attempt]:
    """Try to grasp until a target is held."""
    text, failed = pick_text(scene.goal.text), FailedGrasps()

    def propose(cloud: GeometryCloud, _: HeldObject | None) -> ActionCandidates:
        return failed.without(pipeline.generator.pick(cloud, rngs.candidates))

    for index in range(max_attempts):
        attempt = _attempt(scene, pipeline, rngs, index, text, propose)
        failed.record(attempt.plan, attempt.outcome)
        yield attempt
        if attempt.outcome.success or attempt.outcome.reason is Reason.NOTHING_IN_SIGHT:
            return


def _place(
    scene: Scene, pipeline: Pipeline, rngs: EpisodeRngs, describe_held: _DescribeHeld
) -> Iterator[Attempt]:
    """Put down what is held, once; look again while no place for it is found."""

    def propose(cloud: GeometryCloud, held: HeldObject | None) -> ActionCandidates:
        assert held is not None
        return pipeline.placer.place(cloud, held, rngs.candidates)

    for index in range(PLACE_LOOKS):
        text = place_text(scene.goal.text)
        attempt = _attempt(scene, pipeline, rngs, index, text, propose, describe_held)
        yield attempt
        if not attempt.outcome.reason.is_idle:
            return


def _attempt(
    scene: Scene,
    pipeline: Pipeline,
    rngs: EpisodeRngs,
    index: int,
    text: PhaseText,
    propose: Callable[[GeometryCloud, HeldObject | None], ActionCandidates],
    describe_held: _DescribeHeld | None = None,
) -> Attempt:
    """Look, perceive, propose, decide, plan, act."""
    watch = Stopwatch()
    percept = candidates = scores = plan = held = None
    num_unreachable = 0
    with watch.measure("look"):
        views = look(scene, pipeline, rngs.noise)
    try:
        with watch.measure("perceive"):
            percept = pipeline.lifter.perceive(views, text.text)
    except EmptyCloudError:
        outcome = Outcome(success=False, reason=Reason.NOTHING_IN_SIGHT)
    else:
        with watch.measure("propose"):
            held = None if describe_held is None else describe_held(percept.geometry)
            proposed = propose(percept.geometry, held)
        with watch.measure("reach"):
            candidates = _reachable(pipeline, proposed)
            num_unreachable = len(proposed) - len(candidates)
        with watch.measure("decide"):
            observation = observe(percept, scene, text)
            scores = pipeline.policy.score(observation, candidates, rngs.policy)
        with watch.measure("plan"):
            order = np.argsort(-scores.logits, kind="stable")
            plan = _plan(pipeline, rngs, candidates, order, percept.geometry, held)
        with watch.measure("act"):
            outcome = _act(scene, pipeline, proposed, plan)
    return Attempt(
        index=index,
        kind=text.phase,
        views=views,
        percept=percept,
        candidates=candidates,
        num_unreachable=num_unreachable,
        scores=scores,
        plan=plan,
        held=held,
        outcome=outcome,
        seconds=watch.seconds,
    )


def _reachable(pipeline: Pipeline, proposed: ActionCandidates) -> ActionCandidates:
    if pipeline.keep_unreachable or not len(proposed):
        return proposed
    return proposed.take(np.flatnonzero(pipeline.planner.reachable(proposed)))


def _plan(
    pipeline: Pipeline,
    rngs: EpisodeRngs,
    candidates: ActionCandidates,
    order: np.ndarray,
    cloud: GeometryCloud,
    held: HeldObject | None,
) -> Plan | None:
    if pipeline.perturbation is not None:
        candidates = pipeline.perturbation.apply(candidates, rngs.perturbation)
    # With unreachable candidates among them, the policy's choice is final.
    order = order[:1] if pipeline.keep_unreachable else order
    start = None if held is None else pipeline.executor.drive.arm_qpos
    return pipeline.planner.plan(candidates, order, obstacles=cloud.points, held=held, start=start)


def _act(
    scene: Scene, pipeline: Pipeline, proposed: ActionCandidates, plan: Plan | None
) -> Outcome:
    if plan is None:
        reason = Reason.UNREACHABLE if len(proposed) else Reason.NO_CANDIDATES
        return Outcome(success=False, reason=reason)
    return pipeline.executor.execute(plan, keep_target=scene.goal.place is not None)


def _held_after(attempt: Attempt, pipeline: Pipeline) -> _DescribeHeld:
    """Describe what is in the gripper by the clouds before and after, and the robot's joints."""
    executor = pipeline.executor
    assert attempt.percept is not None and executor.T_world_grasp is not None
    before, T_world_grasp = attempt.percept.geometry, executor.T_world_grasp
    width_m = executor.drive.width_m
    return lambda after: held_object(before, T_world_grasp, width_m, after=after)
