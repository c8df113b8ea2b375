"""What one attempt of an episode saw, decided and brought about."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from perception.lifter import Percept
from perception.views import CameraView
from policy.actions import ActionCandidates, ActionKind, ActionScores
from sr_mj.candidates.held import HeldObject
from sr_mj.outcome import Outcome
from sr_mj.planning import Plan


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """Everything that one attempt saw, decided and brought about.

    Attributes:
        index: Number of the attempt, from 0; those of a hand-over are numbered by themselves.
        kind: Whether it was to pick or to place.
        views: What the cameras saw.
        percept: What was made of it; None if no object was in sight.
        candidates: Actions that the policy chose among.
        num_unreachable: How many more were proposed, but left out since the arm cannot get there.
        scores: The policy's scores; None if there was nothing to score.
        plan: What was executed; None if nothing was.
        held: What was in the gripper, as far as it was seen; for placing only.
        outcome: What came of it.
        is_hand_over: The oracle picks up what the policy is then asked to place; no attempt of the
            policy's.
        seconds: Wall time of each stage.
    """

    index: int
    kind: ActionKind
    views: tuple[CameraView, ...]
    percept: Percept | None
    candidates: ActionCandidates | None
    num_unreachable: int = 0
    scores: ActionScores | None
    plan: Plan | None
    held: HeldObject | None = None
    outcome: Outcome
    is_hand_over: bool = False
    seconds: dict[str, float]

    @property
    def chosen_pose(self) -> np.ndarray | None:
        """The pose (4, 4) that was chosen, without any error of its execution; None if none was."""
        if self.plan is None or self.candidates is None:
            return None
        return self.candidates.Ts_world_tool[self.plan.chosen]


@dataclass(frozen=True)
class Stopwatch:
    """Collects wall times of named stages.

    Attributes:
        seconds: Wall time of each stage, in the order in which they were measured.
    """

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Measure what happens in this context as a stage."""
        start = time.perf_counter()
        yield
        self.seconds[stage] = time.perf_counter() - start
