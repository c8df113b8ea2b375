"""What came of an attempt: named, never an exception."""

from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """How an attempt ended.

    The first three brought something about: a target was lifted and held, an object was put where
    it belongs, or another object was lifted, which costs an attempt but clears the way. The others
    are the causes of failure.
    """

    GRASPED_TARGET = "grasped_target"
    PLACED = "placed"
    GRASPED_OTHER = "wrong_object"
    NOTHING_IN_SIGHT = "nothing_in_sight"
    NO_CANDIDATES = "no_candidate"
    UNREACHABLE = "unreachable"
    APPROACH_COLLISION = "approach_collision"
    EMPTY_CLOSE = "empty_close"
    SLIPPED_LIFT = "slip_lift"
    SLIPPED_CARRY = "slip_carry"
    KNOCKED_OFF = "knocked_off"
    WRONG_REGION = "wrong_region"
    TOPPLED = "toppled"
    TIMED_OUT = "timed_out"

    @property
    def is_grasp(self) -> bool:
        """Whether an object was held through lift and carry."""
        return self in (Reason.GRASPED_TARGET, Reason.GRASPED_OTHER)

    @property
    def is_idle(self) -> bool:
        """Whether the robot did not move, so that looking again is all that it can do."""
        return self in (Reason.NO_CANDIDATES, Reason.UNREACHABLE)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The result of one attempt, judged by the state of the simulation.

    Attributes:
        success: Picking: an object of the target set is held after lift and carry. Placing: the
            object rests in a valid region.
        reason: How the attempt ended.
        grasped: Name of the object that was held, if any.
        knocked_off: Names of the objects that left the workspace or the table by accident.
        reward: 1 for a success; otherwise minus the distance by which it was missed, in diagonals
            of the workspace: of the executed pose to the nearest vertex of a target, or of the
            object that was placed to the nearest valid region. -1 if nothing was executed or
            nothing is valid.
        missed_m: Distance by which a place attempt missed the region; None for others.
        felt_to_end: The fingers felt something until the end of the carry: all that the robot
            itself knows of a grasp.
        num_steps: Simulation steps.
        simulated_s: Simulated seconds.
    """

    success: bool
    reason: Reason
    grasped: str | None = None
    knocked_off: tuple[str, ...] = ()
    reward: float = -1.0
    missed_m: float | None = None
    felt_to_end: bool = False
    num_steps: int = 0
    simulated_s: float = 0.0
