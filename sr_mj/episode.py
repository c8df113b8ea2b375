"""One episode: look, decide, act, look again, until a target is held or the attempts are used up.

This is the one way through the system; command lines and evaluation only start it and read it.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from perception.errors import EmptyCloudError
from perception.lifter import MultiViewLifter, Percept
from perception.views import CameraView
from policy.actions import ActionCandidates, ActionScores
from policy.base import Policy
from policy.observation import Observation
from sr_mj.candidates.generator import CandidateGenerator
from sr_mj.execution import Executor
from sr_mj.memory import FailedGrasps
from sr_mj.outcome import Outcome, Reason
from sr_mj.planning import Plan, Planner
from sr_mj.scene import Scene
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

DEFAULT_ATTEMPTS = 8


@dataclass(frozen=True, kw_only=True)
class Pipeline:
    """The stages of the system, each exchangeable for another with the same interface.

    Attributes:
        rig: Cameras on the scene.
        noise: Sensor noise.
        lifter: Views and instruction to clouds.
        generator: Cloud to grasp candidates.
        policy: Candidates to scores.
        planner: Chosen candidate to plan.
        executor: Plan to outcome.
    """

    rig: CameraRig
    noise: L515NoiseConfig
    lifter: MultiViewLifter
    generator: CandidateGenerator
    policy: Policy
    planner: Planner
    executor: Executor


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """Everything that one attempt saw, decided and brought about.

    Attributes:
        index: Number of the attempt, from 0.
        views: What the cameras saw.
        percept: What was made of it; None if no object was in sight.
        candidates: Grasps to choose from.
        scores: The policy's scores; None if there was nothing to score.
        plan: What was executed; None if nothing was.
        outcome: What came of it.
        seconds: Wall time of each stage.
    """

    index: int
    views: tuple[CameraView, ...]
    percept: Percept | None
    candidates: ActionCandidates | None
    scores: ActionScores | None
    plan: Plan | None
    outcome: Outcome
    seconds: dict[str, float]


@dataclass(frozen=True)
class _Stopwatch:
    """Collects wall times of named stages."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[stage] = time.perf_counter() - start


def observe(percept: Percept, scene: Scene) -> Observation:
    """Reduce a percept to what a policy may see: arrays of the cloud and the instruction."""
    cloud = percept.features
    return Observation(
        points=cloud.points,
        features=cloud.features,
        similarity=cloud.similarity,
        confidence=cloud.confidence,
        text_tokens=percept.text.tokens,
        text_pooled=percept.text.pooled,
        workspace_min=np.array(scene.workspace.lower),
        workspace_max=np.array(scene.workspace.upper),
    )


def run_episode(
    scene: Scene, pipeline: Pipeline, *, seed: int, max_attempts: int = DEFAULT_ATTEMPTS
) -> Iterator[Attempt]:
    """Act in a scene until an object of the target set is held.

    Args:
        scene: The scene; its state changes.
        pipeline: The stages, made for this scene.
        seed: Draws sensor noise, candidates and what the policy draws.
        max_attempts: Attempts after which the episode ends.

    Yields:
        Every attempt as it ends; the last one tells how the episode ended.
    """
    noise_rng, candidate_rng, policy_rng = np.random.default_rng(seed).spawn(3)
    failed = FailedGrasps()
    for index in range(max_attempts):
        watch = _Stopwatch()
        percept = candidates = scores = plan = None
        with watch.measure("look"):
            views = capture_views(pipeline.rig, scene.data, pipeline.noise, noise_rng)
        try:
            with watch.measure("perceive"):
                percept = pipeline.lifter.perceive(views, scene.goal.text)
        except EmptyCloudError:
            outcome = Outcome(success=False, reason=Reason.NOTHING_IN_SIGHT)
        else:
            with watch.measure("propose"):
                candidates = failed.without(
                    pipeline.generator.pick(percept.geometry, candidate_rng)
                )
            with watch.measure("decide"):
                scores = pipeline.policy.score(observe(percept, scene), candidates, policy_rng)
            with watch.measure("plan"):
                order = np.argsort(-scores.logits, kind="stable")
                plan = pipeline.planner.plan(candidates, order)
            with watch.measure("act"):
                outcome = _act(pipeline.executor, candidates, plan)
            failed.record(plan, outcome)
        yield Attempt(
            index=index,
            views=views,
            percept=percept,
            candidates=candidates,
            scores=scores,
            plan=plan,
            outcome=outcome,
            seconds=watch.seconds,
        )
        if outcome.success or outcome.reason is Reason.NOTHING_IN_SIGHT:
            return


def _act(executor: Executor, candidates: ActionCandidates, plan: Plan | None) -> Outcome:
    if plan is not None:
        return executor.execute(plan)
    reason = Reason.UNREACHABLE if len(candidates) else Reason.NO_CANDIDATES
    return Outcome(success=False, reason=reason)
