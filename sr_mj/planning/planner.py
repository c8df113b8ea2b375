"""From a chosen candidate to a `Plan`: collision-checked joint paths, timed, with openings.

For every candidate the closed form gives all postures along the straight ways; mink follows them
from the best posture within its limits; free motions join them.
"""

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from models.tabletop import BIN_CENTER
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.kinematics import ArmKinematics
from sr_mj.planning.body import RobotBody
from sr_mj.planning.clearance import Clearance
from sr_mj.planning.config import PlannerConfig
from sr_mj.planning.obstacles import find_obstacles
from sr_mj.planning.pick import plan_pick
from sr_mj.planning.place import plan_place
from sr_mj.planning.plan import Plan
from sr_mj.planning.reach import find_reachable
from sr_mj.planning.straight import solve_ways
from sr_mj.planning.task import PlanningTask

if TYPE_CHECKING:
    from sr_mj.candidates.held import HeldObject


class Planner:
    """Plans picks and placements for one robot.

    Args:
        config: Geometry and speed.
        kinematics: IK solver; made when None.

    Attributes:
        postures_over_bin: (B, 6) postures, rad, in which what is held is carried over the bin.
    """

    def __init__(
        self, config: PlannerConfig | None = None, kinematics: ArmKinematics | None = None
    ) -> None:
        """Compute the postures over the bin, which every pick shares."""
        self.config = config or PlannerConfig()
        self.kinematics = kinematics or ArmKinematics()
        self._body = RobotBody(self.kinematics.config.max_overlap_m)
        T_world_bin = np.diag([1.0, -1.0, -1.0, 1.0])
        T_world_bin[:3, 3] = (*BIN_CENTER[:2], self.config.carry_height_m)
        (over_bin,) = solve_ways([T_world_bin[None]], HOME_QPOS, np.inf, np.pi).postures
        self.postures_over_bin = over_bin[self._body.is_free(over_bin[:, 0]), 0]

    def reachable(
        self, candidates: ActionCandidates, *, obstacles: np.ndarray | None = None
    ) -> np.ndarray:
        """Tell which candidates the arm can reach and leave, for all of them at once.

        A posture of the closed form must reach the pose and points on the straight ways to and
        from it, without a flip and with links, gripper, table and bin clear of each other.

        Args:
            candidates: K poses of either kind.
            obstacles: (N, 3) points of the cloud, of which the arm's links must then keep clear.

        Returns:
            (K,) verdicts.
        """
        clearance = Clearance(
            body=self._body, obstacles=find_obstacles(obstacles), with_gripper=False
        )
        return find_reachable(candidates, clearance, self.config)

    def plan(
        self,
        candidates: ActionCandidates,
        order: np.ndarray,
        *,
        obstacles: np.ndarray | None = None,
        held: "HeldObject | None" = None,
        start: np.ndarray | None = None,
        shake_off: bool = False,
    ) -> Plan | None:
        """Plan the first candidate, in a given order, that can be executed.

        Args:
            candidates: K poses, to pick or to place.
            order: Indices of candidates, most wanted first.
            obstacles: (N, 3) points of the cloud that the candidates come from. Without them the
                arm goes high over whatever may stand on the table.
            held: The object to place.
            start: (6,) posture of the arm, rad; home when None.
            shake_off: Whether a pick tilts what it holds over the bin, so that only what is between
                the fingers stays.

        Returns:
            The plan, or None if no candidate, or none of the first `num_tried` that have a good
            verdict beside the obstacles, can be reached without collision.
        """
        order = np.asarray(order, int)
        if not len(order):
            return None
        task = PlanningTask(
            config=self.config,
            kinematics=self.kinematics,
            body=self._body,
            obstacles=find_obstacles(obstacles),
            start=np.asarray(HOME_QPOS if start is None else start, float),
            over_bin=self.postures_over_bin,
        )
        good = self._reachable_in_order(candidates, order, task)
        for index in itertools.islice(good, self.config.num_tried):
            pose, width_m = candidates.Ts_world_tool[index], float(candidates.width_m[index])
            if candidates.kind == "pick":
                drafted = plan_pick(task, pose, width_m, shake_off=shake_off)
            else:
                drafted = plan_place(task, pose, width_m, held)
            if drafted is not None:
                return Plan(
                    chosen=index,
                    T_world_tool=pose,
                    segments=drafted.segments,
                    kind=candidates.kind,
                    searched=drafted.searched,
                )
        return None

    def _reachable_in_order(
        self, candidates: ActionCandidates, order: np.ndarray, task: PlanningTask
    ) -> Iterator[int]:
        """Yield the candidates with a good verdict, which is found for a few at a time."""
        for first in range(0, len(order), self.config.num_tried):
            few = order[first : first + self.config.num_tried]
            is_good = find_reachable(candidates.take(few), task.links, self.config)
            yield from few[is_good].tolist()
