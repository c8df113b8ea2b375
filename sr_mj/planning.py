"""From a chosen grasp to a `Plan`: collision-checked joint paths, timed, with gripper commands."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.tabletop import BIN_CENTER
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.kinematics import ArmKinematics
from sr_mj.trajectory import MotionLimits, Trajectory, time_waypoints

# The gripper looks the same turned by half a turn about its approach direction.
_HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])


class Phase(StrEnum):
    """What the arm does in a segment of a plan."""

    TRANSIT = "transit"
    APPROACH = "approach"
    CLOSE = "close"
    LIFT = "lift"
    CARRY = "carry"
    RELEASE = "release"
    RETURN = "return"


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
    """A complete pick: reach, grasp, lift, carry to the bin, release, return.

    Attributes:
        chosen: Index of the candidate.
        T_world_tool: (4, 4) grasp pose of the tool.
        segments: In order of execution.
    """

    chosen: int
    T_world_tool: np.ndarray
    segments: tuple[Segment, ...]


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """Geometry and speed of a pick.

    Attributes:
        approach_m: Length of the straight approach to the grasp.
        extra_width_m: How much wider than the contact width the fingers open for the approach.
        transit_height_m: Height of the tool, at least, while it moves over the heap.
        lift_m: How far a grasped object is lifted straight up.
        carry_height_m: Height of the tool over the bin.
        step_m: Distance between waypoints of a straight path.
        max_joint_step: Largest joint motion between these waypoints, rad; more means that the
            arm would flip from one IK branch to another.
        num_tried: Candidates that are tried, best first, until one has a plan.
        limits: Joint limits for free motion.
        approach_speed: Fraction of the limits for approach and lift.
        carry_speed: Fraction of the limits while an object is held.
    """

    approach_m: float = 0.10
    extra_width_m: float = 0.02
    transit_height_m: float = 0.28
    lift_m: float = 0.20
    carry_height_m: float = 0.32
    step_m: float = 0.01
    max_joint_step: float = 0.35
    num_tried: int = 12
    limits: MotionLimits = field(default_factory=MotionLimits)
    approach_speed: float = 0.35
    carry_speed: float = 0.6


def straight_poses(T_start: np.ndarray, T_end: np.ndarray, step_m: float) -> np.ndarray:
    """Interpolate between two poses: straight in position, shortest in rotation.

    Args:
        T_start: (4, 4).
        T_end: (4, 4).
        step_m: Largest distance between two poses, metres.

    Returns:
        (P, 4, 4) poses, both ends included, P >= 2.
    """
    num = max(int(np.ceil(np.linalg.norm(T_end[:3, 3] - T_start[:3, 3]) / step_m)), 1) + 1
    u = np.linspace(0, 1, num)
    poses = np.tile(np.eye(4), (num, 1, 1))
    poses[:, :3, 3] = T_start[:3, 3] + u[:, None] * (T_end[:3, 3] - T_start[:3, 3])
    ends = Rotation.from_matrix(np.stack([T_start[:3, :3], T_end[:3, :3]]))
    poses[:, :3, :3] = Slerp([0, 1], ends)(u).as_matrix()
    return poses


class Planner:
    """Plans picks for one robot.

    Args:
        config: Geometry and speed.
        kinematics: IK solver; made when None.
    """

    def __init__(
        self, config: PlannerConfig | None = None, kinematics: ArmKinematics | None = None
    ) -> None:
        """Compute the posture over the bin, which every pick shares."""
        self.config = config or PlannerConfig()
        self.kinematics = kinematics or ArmKinematics()
        T_world_bin = np.diag([1.0, -1.0, -1.0, 1.0])
        T_world_bin[:3, 3] = (*BIN_CENTER[:2], self.config.carry_height_m)
        self._bin_postures = [
            posture
            for turn in (np.eye(4), _HALF_TURN)
            for posture in self.kinematics.solve_any(T_world_bin @ turn)
        ]

    def plan(self, candidates: ActionCandidates, order: np.ndarray) -> Plan | None:
        """Plan a pick of the first candidate, in a given order, that can be executed.

        Args:
            candidates: K grasps.
            order: Indices of candidates, most wanted first.

        Returns:
            The plan, or None if none of the first `num_tried` candidates can be reached without
            collision.
        """
        for index in order[: self.config.num_tried]:
            pose = candidates.Ts_world_tool[index]
            segments = self._plan_grasp(pose, float(candidates.width_m[index]))
            if segments is not None:
                return Plan(chosen=int(index), T_world_tool=pose, segments=segments)
        return None

    def _plan_grasp(self, T_world_tool: np.ndarray, width_m: float) -> tuple[Segment, ...] | None:
        width_m = min(width_m + self.config.extra_width_m, ROBOTIQ_2F85_CLASS.max_width_m)
        for grasp, pose in self._grasp_postures(T_world_tool):
            paths = self._straight_paths(grasp, pose)
            if paths is None:
                continue
            approach, lift = paths
            over_bin = self._nearest_bin_posture(lift[-1])
            moves = (
                (HOME_QPOS, approach[0]),
                (lift[-1], over_bin),
                (over_bin, HOME_QPOS),
            )
            if all(self._is_free_between(start, end) for start, end in moves):
                return self._time(approach, lift, over_bin, width_m)
        return None

    def _grasp_postures(self, T_world_tool: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield postures (6,) for a grasp and its half turn with the pose, nearest home first."""
        options = [
            (posture, pose)
            for pose in (T_world_tool, T_world_tool @ _HALF_TURN)
            for posture in self.kinematics.solve_any(pose)
        ]
        yield from sorted(options, key=lambda option: float(np.abs(option[0] - HOME_QPOS).sum()))

    def _straight_paths(
        self, grasp: np.ndarray, T_world_tool: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the joint paths down to the grasp (A, 6) and up from it (L, 6)."""
        pre_grasp, above, lifted = (T_world_tool.copy() for _ in range(3))
        pre_grasp[:3, 3] -= self.config.approach_m * T_world_tool[:3, 2]
        above[:3, 3] = pre_grasp[:3, 3]
        above[2, 3] = max(pre_grasp[2, 3], self.config.transit_height_m)
        lifted[2, 3] += self.config.lift_m
        # Followed backwards from the grasp, where the IK branch has been chosen.
        up = np.concatenate(
            [
                straight_poses(T_world_tool, pre_grasp, self.config.step_m),
                straight_poses(pre_grasp, above, self.config.step_m)[1:],
            ]
        )
        approach = self._follow(up, grasp)
        lift = self._follow(straight_poses(T_world_tool, lifted, self.config.step_m), grasp)
        return None if approach is None or lift is None else (approach[::-1], lift)

    def _follow(self, poses: np.ndarray, start: np.ndarray) -> np.ndarray | None:
        """Solve IK along poses (P, 4, 4) from a start posture; (P, 6), or None where it fails."""
        path = [start]
        for pose in poses[1:]:
            posture = self.kinematics.solve(pose, path[-1])
            if posture is None or np.abs(posture - path[-1]).max() > self.config.max_joint_step:
                return None
            if not self.kinematics.is_free(posture):
                return None
            path.append(posture)
        return np.array(path)

    def _nearest_bin_posture(self, posture: np.ndarray) -> np.ndarray:
        gaps = [np.abs(option - posture).max() for option in self._bin_postures]
        return self._bin_postures[int(np.argmin(gaps))]

    def _is_free_between(self, start: np.ndarray, end: np.ndarray) -> bool:
        num = max(int(np.ceil(np.abs(end - start).max() / 0.1)), 1)
        return all(
            self.kinematics.is_free(start + u * (end - start)) for u in np.linspace(0, 1, num + 1)
        )

    def _time(
        self, approach: np.ndarray, lift: np.ndarray, over_bin: np.ndarray, width_m: float
    ) -> tuple[Segment, ...]:
        free = self.config.limits
        slow = free.scaled(self.config.approach_speed)
        carry = free.scaled(self.config.carry_speed)
        fully_open = ROBOTIQ_2F85_CLASS.max_width_m

        def move(waypoints: list[np.ndarray] | np.ndarray, limits: MotionLimits) -> Trajectory:
            return time_waypoints(np.asarray(waypoints), limits)

        return (
            Segment(
                phase=Phase.TRANSIT,
                trajectory=move([HOME_QPOS, approach[0]], free),
                width_m=width_m,
            ),
            Segment(phase=Phase.APPROACH, trajectory=move(approach, slow), width_m=width_m),
            Segment(phase=Phase.CLOSE, trajectory=None, width_m=0.0),
            Segment(phase=Phase.LIFT, trajectory=move(lift, slow), width_m=0.0),
            Segment(phase=Phase.CARRY, trajectory=move([lift[-1], over_bin], carry), width_m=0.0),
            Segment(phase=Phase.RELEASE, trajectory=None, width_m=fully_open),
            Segment(phase=Phase.RETURN, trajectory=move([over_bin, HOME_QPOS], free), width_m=0.0),
        )
