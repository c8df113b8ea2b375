"""What the planner hands to the executor."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from policy.actions import ActionKind
from sr_mj.trajectory import Trajectory


class Phase(StrEnum):
    """What the arm does in a segment of a plan.

    A pick is transit, approach, close, lift, carry, tilt, release, return; a placement is transit,
    lower, release, retreat, return. The tilt is there only if it is asked for, and if the arm can
    in the posture in which it comes to be over the bin.
    """

    TRANSIT = "transit"
    APPROACH = "approach"
    CLOSE = "close"
    LIFT = "lift"
    CARRY = "carry"
    TILT = "tilt"
    LOWER = "lower"
    RELEASE = "release"
    RETREAT = "retreat"
    RETURN = "return"


PICK_PHASES = (
    Phase.TRANSIT, Phase.APPROACH, Phase.CLOSE, Phase.LIFT, Phase.CARRY, Phase.TILT, Phase.RELEASE,
    Phase.RETURN,
)  # fmt: skip
PLACE_PHASES = (Phase.TRANSIT, Phase.LOWER, Phase.RELEASE, Phase.RETREAT, Phase.RETURN)


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """One phase of a plan: a motion of the arm, then a motion of the fingers.

    Attributes:
        phase: What it is for.
        trajectory: Motion of the arm; None where only the fingers move.
        width_m: Opening that is commanded, metres; 0 closes with the force limit.
    """

    phase: Phase
    trajectory: Trajectory | None
    width_m: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A complete pick or placement, from the posture where the arm is to home.

    Attributes:
        chosen: Index of the candidate.
        T_world_tool: (4, 4) pose of the tool at which the gripper closes or opens.
        segments: In order of execution.
        kind: What the gripper does at the pose, as in `ActionCandidates.kind`.
        searched: Phases for whose path the sampling planner was needed.
    """

    chosen: int
    T_world_tool: np.ndarray
    segments: tuple[Segment, ...]
    kind: ActionKind = "pick"
    searched: tuple[Phase, ...] = ()
