"""The expert at work in one scene: looks, tries goals from one state, keeps what succeeds."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from perception.errors import EmptyCloudError
from perception.lifter import Percept
from perception.views import CameraView
from policy.actions import ActionCandidates
from policy.demonstrations import Decision, Look, Wording
from sr_mj.candidates.held import HeldObject, held_object
from sr_mj.collecting.choices import Choice, Seen, meant_objects
from sr_mj.collecting.detours import needs_detour
from sr_mj.errors import SceneError
from sr_mj.execution import Executor
from sr_mj.instruction import PhaseText
from sr_mj.oracle import OraclePolicy
from sr_mj.outcome import Outcome
from sr_mj.pipeline import Pipeline, look, observe
from sr_mj.planning import Plan
from sr_mj.scene import Goal, Scene
from sr_mj.scene.placement import find_object

_VALID_LOGIT = 7.5
"""The oracle gives 8.5 or more where a candidate does what is asked for; up to 6.5 to a place
inside the region from which the object fell when it was tried, and less than 2 elsewhere."""

_ON_TARGET_M = 0.006
_LEAST_IN_SIGHT = 5
"""So many points of the cloud have to lie so near to a target for it to be in sight: of what is
hidden altogether, nothing tells what hides it."""


class Expert:
    """Looks, chooses by ground truth, plans and acts in one scene.

    Args:
        scene: The scene; its state changes.
        pipeline: The stages, made for this scene.
        rng: Draws sensor noise and candidates.

    Attributes:
        scene: The scene.
        pipeline: The stages.
        looks: What was seen so far.
        decisions: What succeeded, each with the index of its look.
        reasons: How often what was tried ended how.
    """

    def __init__(self, scene: Scene, pipeline: Pipeline, rng: np.random.Generator) -> None:
        """Start with nothing seen."""
        self.scene, self.pipeline = scene, pipeline
        self.looks: list[Look] = []
        self.decisions: list[tuple[int, Decision]] = []
        self.reasons: Counter[str] = Counter()
        self._noise, self._candidates, self._policy = rng.spawn(3)

    def look(self) -> tuple[tuple[CameraView, ...], Percept] | None:
        """Take views and perceive them; None if no object is in sight."""
        views = look(self.scene, self.pipeline, self._noise)
        try:
            return views, self.pipeline.lifter.perceive(views, "object")
        except EmptyCloudError:
            self.reasons["nothing_in_sight"] += 1
            return None

    def see_grasps(self) -> Seen | None:
        """Look, and propose grasps; None if there is nothing to grasp."""
        found = self.look()
        if found is None:
            return None
        proposed = self.pipeline.generator.pick(found[1].geometry, self._candidates)
        return self._seen(*found, proposed, None)

    def see_places(self, before: Seen, T_world_grasp: np.ndarray, width_m: float) -> Seen | None:
        """Look with an object in the gripper, and propose places; None if there are none.

        Args:
            before: The look before the object was picked.
            T_world_grasp: (4, 4) pose of the tool, by its joints, at which it was picked.
            width_m: Opening of the gripper.

        Returns:
            What was seen.
        """
        found = self.look()
        if found is None:
            return None
        after = found[1].geometry
        held = held_object(before.percept.geometry, T_world_grasp, width_m, after=after)
        proposed = self.pipeline.placer.place(after, held, self._candidates)
        return self._seen(*found, proposed, held)

    def choose(
        self, seen: Seen, goal: Goal, text: PhaseText, *, may_clear: bool = False
    ) -> Choice | None:
        """Score the candidates for a goal.

        Args:
            seen: What can be done.
            goal: What is wanted.
            text: The instruction.
            may_clear: If no grasp closes on a target, but one is in sight that the gripper could
                hold, choose what to take away first: what the grasp nearest to it closes on.

        Returns:
            The choice; None if no candidate does what is asked for.
        """
        scene = replace(self.scene, goal=goal)
        observation, oracle = observe(seen.percept, scene, text), OraclePolicy(scene)
        logits = oracle.score(observation, seen.candidates, self._policy).logits
        valid, objects = logits > _VALID_LOGIT, meant_objects(scene, goal, text)
        if valid.any():
            return Choice(scene=scene, logits=logits, valid=valid, objects=objects)
        could_be = [n for n in goal.targets if find_object(scene, n).graspable]
        if may_clear and could_be and _is_in_sight(could_be, oracle, seen):
            gripped = oracle.gripped(seen.candidates)
            obstacle = str(gripped[np.argmax(logits)])
            if obstacle:
                scene = replace(scene, goal=replace(goal, targets=(obstacle,)))
                valid = gripped == obstacle
                return Choice(scene=scene, logits=logits, valid=valid, objects=objects, clears=True)
        self.reasons["no_valid_candidate"] += 1
        return None

    def blocked(self, seen: Seen) -> list[str]:
        """List the objects that the gripper could hold and that are in sight, but not in reach.

        Args:
            seen: What can be done.

        Returns:
            Names of those that no grasp closes on.
        """
        oracle = OraclePolicy(self.scene)
        gripped = set(oracle.gripped(seen.candidates))
        could_be = [item.name for item in self.scene.objects if item.graspable]
        return [n for n in could_be if n not in gripped and _is_in_sight([n], oracle, seen)]

    def plan(self, seen: Seen, order: np.ndarray) -> Plan | None:
        """Plan the first of some candidates that can be executed."""
        plan = self.pipeline.planner.plan(
            seen.candidates,
            order,
            obstacles=seen.percept.geometry.points,
            held=seen.held,
            start=None if seen.held is None else self.pipeline.executor.drive.arm_qpos,
        )
        if plan is None:
            self.reasons["unreachable"] += 1
        return plan

    def act(
        self, choice: Choice, plan: Plan, *, keep_target: bool
    ) -> tuple[Executor, Outcome] | None:
        """Execute a plan and count how it ended; None if the simulation became unstable."""
        executor = Executor(choice.scene)
        try:
            outcome = executor.execute(plan, keep_target=keep_target)
        except SceneError:
            self.reasons["unstable"] += 1
            return None
        if not outcome.success:
            self.reasons[outcome.reason.value] += 1
        return executor, outcome

    def store(
        self, seen: Seen, choice: Choice, executed: int, texts: Sequence[PhaseText], seed: int
    ) -> None:
        """Keep a success.

        Args:
            seen: The look that it was chosen after.
            choice: The expert's scores.
            executed: Index of the candidate that was executed.
            texts: The instruction and its other wordings.
            seed: Seed of the scene.
        """
        look = self._kept_look(seen)
        decision = Decision(
            phase=texts[0].phase,
            relation=texts[0].relation,
            side=texts[0].side,
            wordings=tuple(self._wording(seen, text) for text in texts),
            candidates=seen.candidates,
            executed=executed,
            valid=choice.valid,
            avoid_collision=seen.avoid_collision,
            expert_logits=choice.logits,
            seed=seed,
            clears=choice.clears,
            objects=choice.objects,
        )
        self.decisions.append((look, decision))

    def _seen(
        self,
        views: tuple[CameraView, ...],
        percept: Percept,
        proposed: ActionCandidates,
        held: HeldObject | None,
    ) -> Seen | None:
        planner = self.pipeline.planner
        candidates = proposed
        if len(proposed):
            candidates = proposed.take(np.flatnonzero(planner.reachable(proposed)))
        if not len(candidates):
            self.reasons["no_candidate"] += 1
            return None
        drive = self.pipeline.executor.drive
        avoid = needs_detour(
            candidates,
            planner.config,
            self.pipeline.robot,
            percept.geometry.points,
            drive.arm_qpos,
            held,
        )
        return Seen(
            views=views, percept=percept, candidates=candidates, avoid_collision=avoid, held=held
        )

    def _kept_look(self, seen: Seen) -> int:
        """Return the index of a look, which is kept as soon as a decision needs it."""
        cloud, workspace = seen.percept.features, self.scene.workspace
        for index, known in enumerate(self.looks):
            if len(known.points) == len(cloud.points) and np.array_equal(
                known.points, cloud.points
            ):
                return index
        self.looks.append(
            Look(
                points=cloud.points,
                features=cloud.features,
                confidence=cloud.confidence,
                workspace_min=np.array(workspace.lower),
                workspace_max=np.array(workspace.upper),
            )
        )
        return len(self.looks) - 1

    def _wording(self, seen: Seen, text: PhaseText) -> Wording:
        """Perceive the same views once more with respect to an instruction, as an episode would."""
        percept = self.pipeline.lifter.perceive(seen.views, text.text)
        observation = observe(percept, self.scene, text)
        return Wording(
            text=text.text,
            tokens=observation.text_tokens,
            pooled=observation.text_pooled,
            phrase_pooled=observation.phrase_pooled,
            similarity=observation.similarity,
        )


def _is_in_sight(names: Sequence[str], oracle: OraclePolicy, seen: Seen) -> bool:
    """Tell whether the cloud shows one of some objects."""
    distance_m = oracle.distances(names, seen.percept.features.points)
    return int((distance_m < _ON_TARGET_M).sum()) >= _LEAST_IN_SIGHT
