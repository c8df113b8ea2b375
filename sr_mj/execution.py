"""Executes a `Plan` in the simulation and says what came of it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from sr_mj.drive import DriveConfig, RobotDrive, StepHook
from sr_mj.judge import Judge, object_in_gripper, touching_fingers
from sr_mj.outcome import Outcome, Reason
from sr_mj.planning import Phase, Plan, Segment
from sr_mj.scene import Scene
from sr_mj.scene.placement import find_object
from sr_mj.scene.settle import check_stable
from sr_mj.trajectory import MotionLimits, time_waypoints


@dataclass(frozen=True, kw_only=True)
class ExecutionConfig:
    """Thresholds and limits; every time is simulated time.

    Attributes:
        drive: Speeds and tolerances of the robot.
        blocked_tol_rad: Joint error at the end of a motion towards objects from which on something
            is in the way: 0.01 rad is about 5 mm at the tool.
        guard_rad: Joint error at which lowering stops, since what is held has touched down; in
            the air the joints lag by 0.003 rad at most.
        early_touch_m: Height over the place above which touching is a collision.
        release_s: Wait after opening over the bin.
        release_speed: Speed of the opening where something is put down, m/s.
        part_s: Wait after that, before the fingers leave.
        min_rise_m: How far an object must have risen to count as lifted.
        max_slip_m: How far a held object may move in the gripper between the end of the lift and
            that of the carry, and of the tilt.
        settle_limit_s: Longest wait, after placing, until everything lies still.
        calm_for_s: How long it must lie still.
    """

    drive: DriveConfig = field(default_factory=DriveConfig)
    blocked_tol_rad: float = 0.02
    guard_rad: float = 0.01
    early_touch_m: float = 0.015
    release_s: float = 0.4
    release_speed: float = 0.04
    part_s: float = 0.2
    min_rise_m: float = 0.05
    max_slip_m: float = 0.03
    settle_limit_s: float = 5.0
    calm_for_s: float = 0.1


_CALM_INTERVAL_S = 0.05
_RETREAT_WAYPOINTS = 12
_WAKING_SPEED = 0.01
_RETREAT_LIMITS = MotionLimits().scaled(0.35)


class Executor:
    """Drives the robot of one scene.

    What the robot does depends on what it feels in its joints and fingers alone; what is reported
    of it, and whether an object is kept or dropped into the bin, on the true state.

    Args:
        scene: The scene; its `data` is stepped.
        config: Thresholds and limits.
        on_step: Called after every simulation step.

    Attributes:
        T_world_grasp: Pose (4, 4) of the tool, by its joints, at which it last closed on something;
            None before.
    """

    def __init__(
        self, scene: Scene, config: ExecutionConfig | None = None, on_step: StepHook | None = None
    ) -> None:
        """Look up the robot's joints and actuators."""
        self.config = config or ExecutionConfig()
        self.drive = RobotDrive(scene, self.config.drive, on_step)
        self._scene = scene
        self.T_world_grasp: np.ndarray | None = None

    def execute(self, plan: Plan, *, keep_target: bool = False) -> Outcome:
        """Execute a plan to its end, and judge it by the objects' motion.

        A real robot feels an empty or lost grasp by its fingers; so does this one, and then
        returns home.

        Args:
            plan: What to do.
            keep_target: Whether a target that was picked stays in the closed gripper over the bin,
                for a plan to place it; anything else is dropped into the bin.

        Returns:
            The outcome.
        """
        start_time = self._scene.data.time
        judge = Judge(self._scene)
        segments = {segment.phase: segment for segment in plan.segments}
        if plan.kind == "pick":
            outcome = self._pick(plan, segments, judge, keep_target)
        else:
            outcome = self._place(plan, segments, judge)
        check_stable(self._scene.data)
        elapsed = self._scene.data.time - start_time
        return replace(
            outcome,
            num_steps=round(elapsed / self._scene.model.opt.timestep),
            simulated_s=round(elapsed, 3),
        )

    def _pick(
        self, plan: Plan, segments: dict[Phase, Segment], judge: Judge, keep_target: bool
    ) -> Outcome:
        reason, held, felt_to_end = self._grasp(segments, judge)
        if reason.is_grasp:
            is_kept = keep_target and reason is Reason.GRASPED_TARGET
            if not is_kept:
                self._drop_into_bin(segments)
        knocked_off = judge.knocked_off(held if reason.is_grasp else None)
        if knocked_off and reason in (Reason.APPROACH_COLLISION, Reason.EMPTY_CLOSE):
            reason = Reason.KNOCKED_OFF
        success = reason is Reason.GRASPED_TARGET
        return Outcome(
            success=success,
            reason=reason,
            grasped=held if reason.is_grasp else None,
            knocked_off=knocked_off,
            reward=1.0 if success else judge.grasp_reward(plan.T_world_tool[:3, 3]),
            felt_to_end=felt_to_end,
        )

    def _grasp(
        self, segments: dict[Phase, Segment], judge: Judge
    ) -> tuple[Reason, str | None, bool]:
        """Reach, close, lift, carry, tilt; a grasp that is felt to be empty ends at home.

        Returns:
            How it ended, what was lifted, and whether the fingers felt something to the end.
        """
        self._move(segments[Phase.TRANSIT])
        error = self._move(segments[Phase.APPROACH])
        if error > self.config.blocked_tol_rad:
            self._go_back(segments, (Phase.APPROACH, Phase.TRANSIT))
            return Reason.APPROACH_COLLISION, None, False
        self.drive.close()
        if not self.drive.feels_object:
            self._go_back(segments, (Phase.APPROACH, Phase.TRANSIT))
            return Reason.EMPTY_CLOSE, None, False
        self.T_world_grasp = self.drive.T_world_tool
        self._move(segments[Phase.LIFT])
        held = judge.lifted_object(self.config.min_rise_m)
        grip = np.zeros(3) if held is None else judge.position_in_tool(held)
        self._move(segments[Phase.CARRY])
        if self.drive.feels_object and Phase.TILT in segments:
            self._move(segments[Phase.TILT])
        if not self.drive.feels_object:
            self._move(segments[Phase.RETURN])
            return (Reason.SLIPPED_LIFT if held is None else Reason.SLIPPED_CARRY), held, False
        if held is None:
            self._drop_into_bin(segments)
            return Reason.SLIPPED_LIFT, None, True
        if np.linalg.norm(judge.position_in_tool(held) - grip) > self.config.max_slip_m:
            self._drop_into_bin(segments)
            return Reason.SLIPPED_CARRY, held, True
        is_target = held in self._scene.goal.targets
        return (Reason.GRASPED_TARGET if is_target else Reason.GRASPED_OTHER), held, True

    def _place(self, plan: Plan, segments: dict[Phase, Segment], judge: Judge) -> Outcome:
        moved = object_in_gripper(self._scene)
        judge.begin_place(moved)
        is_blocked = self._move(segments[Phase.TRANSIT]) > self.config.blocked_tol_rad
        is_lost = self._has_lost(moved)
        followed = self._lower(segments[Phase.LOWER])
        early_m = self.drive.T_world_tool[2, 3] - plan.T_world_tool[2, 3]
        is_blocked |= bool(early_m > self.config.early_touch_m)
        if not is_blocked:
            is_lost |= self._has_lost(moved)
        if moved is not None:
            judge.begin_release(moved)
        with self._waking():
            self.drive.let_go(segments[Phase.RELEASE].width_m, self.config.release_speed)
        self.drive.hold(self.config.part_s)
        self._retreat(segments, followed)
        self._move(segments[Phase.RETURN])
        self._settle(judge)
        failure = Reason.APPROACH_COLLISION if is_blocked else None
        return self._judge_place(judge, moved, Reason.SLIPPED_CARRY if is_lost else failure)

    def _has_lost(self, moved: str | None) -> bool:
        """Tell whether the gripper is empty, or what it held is not in it any more."""
        is_there = moved is None or moved in touching_fingers(self._scene)
        return not (self.drive.feels_object and is_there)

    def _judge_place(self, judge: Judge, moved: str | None, failure: Reason | None) -> Outcome:
        """Judge the settled state; what failed on the way explains an object that is not placed."""
        if moved is None:
            return Outcome(success=False, reason=Reason.SLIPPED_CARRY)
        reason, missed = judge.place_reason(moved), judge.missed_m(moved)
        if failure is not None and reason is not Reason.PLACED:
            reason = failure
        diagonal = self._scene.workspace.diagonal_m
        success = reason is Reason.PLACED
        return Outcome(
            success=success,
            reason=reason,
            grasped=moved,
            knocked_off=judge.knocked_off(moved),
            reward=1.0 if success else -1.0 if missed is None else -min(missed / diagonal, 1.0),
            missed_m=None if missed is None else round(missed, 4),
        )

    def _lower(self, segment: Segment) -> float:
        """Lower until the end or until something is touched; return the seconds followed."""
        assert segment.trajectory is not None
        return self.drive.move(segment.trajectory, segment.width_m, guard_rad=self.config.guard_rad)

    def _retreat(self, segments: dict[Phase, Segment], followed: float) -> None:
        """Leave what was put down, also from where lowering was stopped on the way."""
        lower, retreat = segments[Phase.LOWER].trajectory, segments[Phase.RETREAT]
        assert lower is not None and retreat.trajectory is not None
        if followed == lower.duration_s:
            self._move(retreat)
            return
        # The same way as planned, beginning where the arm is: going to its start would press.
        u = np.linspace(0, 1, _RETREAT_WAYPOINTS)[:, None]
        waypoints = retreat.trajectory.path(u[:, 0])
        waypoints = waypoints + (1 - u) * (self.drive.arm_qpos - waypoints[0])
        self.drive.move(time_waypoints(waypoints, _RETREAT_LIMITS), retreat.width_m)

    def _settle(self, judge: Judge) -> None:
        """Wait until everything lies still, or has had long enough to."""
        calm = waited = 0.0
        while calm < self.config.calm_for_s and waited < self.config.settle_limit_s:
            self.drive.hold(_CALM_INTERVAL_S)
            waited += _CALM_INTERVAL_S
            calm = calm + _CALM_INTERVAL_S if judge.is_calm() else 0.0

    @contextmanager
    def _waking(self) -> Iterator[None]:
        """Wake, afterwards, what the fingers let go of.

        MuJoCo counts what the fingers hold as at rest, lets it sleep as soon as they have parted,
        and leaves it hanging in the air. Pushed down by 1 cm/s, it falls.
        """
        released = touching_fingers(self._scene)
        yield
        for name in released:
            dof = find_object(self._scene, name).body.dof_adr
            self._scene.data.qvel[dof + 2] -= _WAKING_SPEED

    def _drop_into_bin(self, segments: dict[Phase, Segment]) -> None:
        """Open over the bin and go home."""
        with self._waking():
            self.drive.set_width(segments[Phase.RELEASE].width_m)
        self.drive.hold(self.config.release_s)
        self._move(segments[Phase.RETURN])

    def _go_back(self, segments: dict[Phase, Segment], phases: tuple[Phase, ...]) -> None:
        """Open to what the approach had, and take the way back that the arm came."""
        self.drive.set_width(segments[phases[0]].width_m)
        for phase in phases:
            segment = segments[phase]
            assert segment.trajectory is not None
            self.drive.move(segment.trajectory, segment.width_m, reverse=True)
        self.drive.set_width(0.0)

    def _move(self, segment: Segment) -> float:
        """Follow a segment's trajectory; return the joint error at its end, rad."""
        assert segment.trajectory is not None
        self.drive.move(segment.trajectory, segment.width_m)
        return self.drive.error(segment.trajectory.end)
