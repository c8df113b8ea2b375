"""What every candidate of one decision shares, and the steps that picks and placements share."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np

from sr_mj.kinematics import ArmKinematics
from sr_mj.planning.body import RobotBody
from sr_mj.planning.clearance import Clearance
from sr_mj.planning.config import PlannerConfig
from sr_mj.planning.motion import Connector, FreePath
from sr_mj.planning.obstacles import Obstacles
from sr_mj.planning.plan import Phase, Segment
from sr_mj.trajectory import time_waypoints

_Way = TypeVar("_Way")
_MAX_SEARCHES = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanningTask:
    """The robot and its surroundings at one decision.

    Attributes:
        config: Geometry and speed.
        kinematics: IK solver.
        body: Places the robot.
        obstacles: The cloud; None if there is none.
        start: (6,) posture where the arm is, rad.
        over_bin: (O, 6) postures over the bin.
    """

    config: PlannerConfig
    kinematics: ArmKinematics
    body: RobotBody
    obstacles: Obstacles | None
    start: np.ndarray
    over_bin: np.ndarray

    @cached_property
    def motions(self) -> Connector:
        """Finds free motions."""
        return Connector(config=self.config, searches_left=self.config.search.max_searches)

    @cached_property
    def links(self) -> Clearance:
        """Measures the arm without its gripper against the cloud."""
        return Clearance(body=self.body, obstacles=self.obstacles, with_gripper=False)

    @cached_property
    def robot(self) -> Clearance:
        """Measures the arm with its gripper against the cloud."""
        return Clearance(body=self.body, obstacles=self.obstacles)

    def follow(self, poses: np.ndarray, start: np.ndarray) -> np.ndarray | None:
        """Follow a straight way (P, 4, 4) with mink from a posture; (P, 6), None if it can't."""
        return self.kinematics.follow(poses, start, self.config.max_joint_step)


@dataclass(frozen=True, kw_only=True, eq=False)
class Draft:
    """Timed segments of a plan.

    Attributes:
        segments: In order of execution.
        searched: Phases whose path was searched.
    """

    segments: tuple[Segment, ...]
    searched: tuple[Phase, ...]


@dataclass(eq=False)
class DraftBuilder:
    """Collects segments and times them.

    Attributes:
        config: Speeds.
    """

    config: PlannerConfig
    _segments: list[Segment] = field(default_factory=list)
    _searched: list[Phase] = field(default_factory=list)

    def move(self, phase: Phase, path: FreePath | np.ndarray, speed: float, width_m: float) -> None:
        """Add a motion of the arm at a fraction of the limits, fingers at an opening."""
        if isinstance(path, FreePath):
            self._searched += [phase] if path.is_searched else []
            path = path.waypoints
        trajectory = time_waypoints(path, self.config.limits.scaled(speed))
        self._segments.append(Segment(phase=phase, trajectory=trajectory, width_m=width_m))

    def set_width(self, phase: Phase, width_m: float) -> None:
        """Add a motion of the fingers."""
        self._segments.append(Segment(phase=phase, trajectory=None, width_m=width_m))

    def finish(self) -> Draft:
        """Return what was collected."""
        return Draft(segments=tuple(self._segments), searched=tuple(self._searched))


def first_draft(ways: Iterable[_Way], join: Callable[[_Way, bool], Draft | None]) -> Draft | None:
    """Join the first of several ways that can be joined, without a search if there is one.

    Args:
        ways: Made only as far as they are needed.
        join: Joins one; its second argument says whether it may search.

    Returns:
        The draft, or None.
    """
    seen: list[_Way] = []
    for way in ways:
        draft = join(way, False)
        if draft is not None:
            return draft
        seen.append(way)
    drafts = (join(way, True) for way in seen[:_MAX_SEARCHES])
    return next((draft for draft in drafts if draft is not None), None)
