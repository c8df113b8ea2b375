"""What came of an attempt: named, never an exception."""

from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """How an attempt ended.

    The first two are successes: something was lifted out of the scene; `GRASPED_OTHER` costs an
    attempt but clears the way.
    """

    GRASPED_TARGET = "grasped_target"
    GRASPED_OTHER = "grasped_other"
    NOTHING_IN_SIGHT = "nothing_in_sight"
    NO_CANDIDATES = "no_candidates"
    UNREACHABLE = "unreachable"
    APPROACH_COLLISION = "approach_collision"
    EMPTY_CLOSE = "empty_close"
    SLIPPED_LIFT = "slipped_lift"
    SLIPPED_CARRY = "slipped_carry"

    @property
    def is_grasp(self) -> bool:
        """Whether an object was held through lift and carry."""
        return self in (Reason.GRASPED_TARGET, Reason.GRASPED_OTHER)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The result of one executed plan, judged by the state of the simulation.

    Attributes:
        success: An object of the target set is held after lift and carry.
        reason: How the attempt ended.
        grasped: Name of the object that was held, if any.
        num_steps: Simulation steps.
        simulated_s: Simulated seconds.
    """

    success: bool
    reason: Reason
    grasped: str | None = None
    num_steps: int = 0
    simulated_s: float = 0.0
