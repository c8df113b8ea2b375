"""One episode: look, decide, act, look again, until the goal is met or the attempts are used up.

This is the one way through the system; command lines and evaluation only start it and read it.
"""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace

import numpy as np

from models.workspace import Workspace
from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates
from sr_mj.attempt import Attempt, Stopwatch
from sr_mj.beginning import Beginning, HandOver
from sr_mj.candidates.held import HeldObject, held_object
from sr_mj.choice import plan_choice
from sr_mj.instruction import names_target, pick_text, place_text
from sr_mj.memory import FailedGrasps
from sr_mj.oracle import OraclePolicy
from sr_mj.outcome import Outcome, Reason
from sr_mj.perturbation import PoseError
from sr_mj.pipeline import EpisodeRngs, Pipeline, observe
from sr_mj.planning import Plan
from sr_mj.scene import Scene
from sr_mj.scene.state import SceneState
from sr_mj.situation import DescribeHeld, Situation, assess
from sr_mj.view_images import ViewImages

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
    scene: Scene,
    pipeline: Pipeline,
    *,
    seed: int,
    max_attempts: int = DEFAULT_ATTEMPTS,
    beginning: Beginning | None = None,
) -> Iterator[Attempt]:
    """Act in a scene until an object of the target set is held, and put where it is asked for.

    Args:
        scene: The scene; its state changes.
        pipeline: The stages, made for this scene.
        seed: Draws sensor noise, candidates, what the policy draws, and errors of poses.
        max_attempts: Grasps after which the episode ends; placing is tried once.
        beginning: What `begin_episode` made of the same scene, seed and number of attempts; None to
            begin here. The scene goes back to it, so that policies can share what is the same
            for all of them.

    Yields:
        Every attempt as it ends; the last one tells how the episode ended. If the object to place
        is handed over, the oracle's attempts to pick it come first.
    """
    begun = beginning or begin_episode(scene, pipeline, seed=seed, max_attempts=max_attempts)
    rngs = begun.enter(pipeline.executor)
    yield from begun.hand_over.attempts
    if begun.first is None:
        return
    describe_held = begun.hand_over.describe_held
    if describe_held is not None:
        yield from _place(scene, pipeline, rngs, describe_held, begun.first)
        return
    for attempt in _pick(scene, pipeline, rngs, max_attempts, begun.first):
        yield attempt
        if attempt.outcome.success and scene.goal.place is not None:
            yield from _place(scene, pipeline, rngs, _held_after(attempt, pipeline))


def begin_episode(
    scene: Scene,
    pipeline: Pipeline,
    *,
    seed: int,
    max_attempts: int = DEFAULT_ATTEMPTS,
    handed: HandOver | None = None,
) -> Beginning:
    """Do what does not depend on the policy: hand over what is to be placed, and look once.

    Args:
        scene: The scene; its state changes.
        pipeline: The stages; its policy is not asked.
        seed: As for `run_episode`.
        max_attempts: Grasps with which the oracle tries to hand something over.
        handed: What `hand_over` made of the same scene, seed and number of attempts; None to do it
            here.

    Returns:
        What the first decision is about, and the way back to it.
    """
    handed = handed or hand_over(scene, pipeline, seed=seed, max_attempts=max_attempts)
    handed.state.restore()
    rngs, describe_held = deepcopy(handed.rngs), handed.describe_held
    first = None
    if describe_held is not None:
        first = _assess_places(scene, pipeline, rngs, describe_held)
    elif not handed.attempts:
        first = _assess_grasps(scene, pipeline, rngs, FailedGrasps())
    return Beginning(hand_over=handed, first=first, rngs=rngs)


def hand_over(
    scene: Scene, pipeline: Pipeline, *, seed: int, max_attempts: int = DEFAULT_ATTEMPTS
) -> HandOver:
    """Let the oracle pick what is to be placed, if the goal is to place something unnamed.

    Args:
        scene: The scene; its state changes.
        pipeline: The stages; its policy is not asked.
        seed: As for `run_episode`.
        max_attempts: Grasps that may be tried.

    Returns:
        The state that this leads to: that of the scene as it is if nothing is to be handed over.
    """
    rngs, attempts, describe_held = EpisodeRngs.of_episode(scene, seed), [], None
    if is_handed_over(scene):
        picking = pipeline.handing_over(OraclePolicy(scene))
        for attempt in _pick(scene, picking, rngs, max_attempts):
            attempts.append(replace(attempt, is_hand_over=True))
            if attempt.outcome.success:
                describe_held = _held_after(attempt, pipeline)
    return HandOver(
        attempts=tuple(attempts),
        describe_held=describe_held,
        state=SceneState(scene),
        T_world_grasp=pipeline.executor.T_world_grasp,
        rngs=rngs,
    )


def _pick(
    scene: Scene,
    pipeline: Pipeline,
    rngs: EpisodeRngs,
    max_attempts: int,
    first: Situation | None = None,
) -> Iterator[Attempt]:
    """Try to grasp until a target is held."""
    failed = FailedGrasps()
    for index in range(max_attempts):
        situation = first if first is not None and index == 0 else None
        situation = situation or _assess_grasps(scene, pipeline, rngs, failed)
        attempt = _attempt(scene, pipeline, rngs, index, situation, _draw_error(pipeline, rngs))
        failed.record(attempt.chosen_pose, attempt.outcome)
        yield attempt
        if attempt.outcome.success or attempt.outcome.reason is Reason.NOTHING_IN_SIGHT:
            return


def _place(
    scene: Scene,
    pipeline: Pipeline,
    rngs: EpisodeRngs,
    describe_held: DescribeHeld,
    first: Situation | None = None,
) -> Iterator[Attempt]:
    """Put down what is held, once; look again while no place for it is found."""
    # Of one action there is one error, however often it takes to find a place.
    error = _draw_error(pipeline, rngs)
    for index in range(PLACE_LOOKS):
        situation = first if first is not None and index == 0 else None
        situation = situation or _assess_places(scene, pipeline, rngs, describe_held)
        attempt = _attempt(scene, pipeline, rngs, index, situation, error)
        yield attempt
        reason = attempt.outcome.reason
        is_lost = pipeline.keep_unreachable and reason is Reason.UNREACHABLE
        if is_lost or not reason.is_idle:
            return


def _draw_error(pipeline: Pipeline, rngs: EpisodeRngs) -> PoseError | None:
    return None if pipeline.perturbation is None else pipeline.perturbation.draw(rngs.perturbation)


def _assess_grasps(
    scene: Scene, pipeline: Pipeline, rngs: EpisodeRngs, failed: FailedGrasps
) -> Situation:
    def propose(cloud: GeometryCloud, _: HeldObject | None) -> ActionCandidates:
        found = pipeline.generator.pick(cloud, rngs.candidates)
        return failed.without(_inside(scene.zone("pick"), found))

    return assess(scene, pipeline, rngs, pick_text(scene.goal.text), propose)


def _assess_places(
    scene: Scene, pipeline: Pipeline, rngs: EpisodeRngs, describe_held: DescribeHeld
) -> Situation:
    def propose(cloud: GeometryCloud, held: HeldObject | None) -> ActionCandidates:
        assert held is not None
        found = pipeline.placer.place(cloud, held, rngs.candidates)
        return _inside(scene.zone("place"), found)

    return assess(scene, pipeline, rngs, place_text(scene.goal.text), propose, describe_held)


def _inside(zone: Workspace | None, candidates: ActionCandidates) -> ActionCandidates:
    if zone is None:
        return candidates
    return candidates.take(np.flatnonzero(zone.contains_xy(candidates.positions)))


def _attempt(
    scene: Scene,
    pipeline: Pipeline,
    rngs: EpisodeRngs,
    index: int,
    situation: Situation,
    error: PoseError | None,
) -> Attempt:
    """Decide, plan, act."""
    watch = Stopwatch(dict(situation.seconds))
    percept, candidates, proposed = situation.percept, situation.candidates, situation.proposed
    scores = plan = None
    num_unreachable = 0
    if percept is None or candidates is None or proposed is None:
        outcome = Outcome(success=False, reason=Reason.NOTHING_IN_SIGHT)
    else:
        num_unreachable = len(proposed) - len(candidates)
        with watch.measure("decide"):
            images = ViewImages(views=situation.views, encoder=pipeline.lifter.encoder)
            observation = observe(percept, scene, situation.text, images)
            scores = pipeline.policy.score(observation, candidates, rngs.policy)
        with watch.measure("plan"):
            order = np.argsort(-scores.logits, kind="stable")
            plan = plan_choice(scene, pipeline, situation, order, error)
        with watch.measure("act"):
            outcome = _act(scene, pipeline, proposed, plan)
    return Attempt(
        index=index,
        kind=situation.text.phase,
        views=situation.views,
        percept=percept,
        candidates=candidates,
        num_unreachable=num_unreachable,
        scores=scores,
        plan=plan,
        held=situation.held,
        outcome=outcome,
        seconds=watch.seconds,
    )


def _act(
    scene: Scene, pipeline: Pipeline, proposed: ActionCandidates, plan: Plan | None
) -> Outcome:
    if plan is None:
        reason = Reason.UNREACHABLE if len(proposed) else Reason.NO_CANDIDATES
        return Outcome(success=False, reason=reason)
    return pipeline.executor.execute(plan, keep_target=scene.goal.place is not None)


def _held_after(attempt: Attempt, pipeline: Pipeline) -> DescribeHeld:
    """Describe what is in the gripper by the clouds before and after, and the robot's joints."""
    executor = pipeline.executor
    assert attempt.percept is not None and executor.T_world_grasp is not None
    before, T_world_grasp = attempt.percept.geometry, executor.T_world_grasp
    width_m = executor.drive.width_m
    return lambda after: held_object(before, T_world_grasp, width_m, after=after)
