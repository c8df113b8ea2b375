"""Executes a `Plan` in the simulation and says what came of it."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from models.gripper import finger_travel
from models.robot import ARM_ACTUATORS, ARM_JOINTS, GRIPPER_ACTUATOR, GRIPPER_JOINTS, TOOL_SITE_NAME
from sr_mj.outcome import Outcome, Reason
from sr_mj.planning import Phase, Plan, Segment
from sr_mj.scene import Scene
from sr_mj.scene.settle import check_stable

StepHook = Callable[[Scene], None]
"""Called after every simulation step of an execution, for example to record a video."""


@dataclass(frozen=True, kw_only=True)
class ExecutionConfig:
    """Speeds, thresholds and limits; every time is simulated time.

    Attributes:
        finger_speed: Speed at which the commanded opening changes, m/s.
        arrive_tol_rad: Largest joint error with which a motion counts as finished.
        arrive_limit_s: Longest wait for that after a motion's nominal end.
        blocked_tol_rad: Joint error at the end of the approach from which on something is in the
            way: 0.01 rad is about 5 mm at the tool.
        close_limit_s: Longest time that the fingers may take; what they press on may tremble.
        still_speed: Finger speed below which they have stopped, m/s.
        still_for_s: How long they must have stopped.
        empty_width_m: Opening at or under which nothing is between the fingers.
        release_s: Wait after opening over the bin.
        min_rise_m: How far an object must have risen to count as lifted.
        max_slip_m: How far a held object may move in the gripper between lift and carry's end.
    """

    finger_speed: float = 0.15
    arrive_tol_rad: float = 0.004
    arrive_limit_s: float = 0.5
    blocked_tol_rad: float = 0.02
    close_limit_s: float = 2.0
    still_speed: float = 0.002
    still_for_s: float = 0.06
    empty_width_m: float = 0.0015
    release_s: float = 0.4
    min_rise_m: float = 0.05
    max_slip_m: float = 0.03


class Executor:
    """Drives the robot of one scene.

    Args:
        scene: The scene; its `data` is stepped.
        config: Speeds and thresholds.
        on_step: Called after every simulation step.
    """

    def __init__(
        self, scene: Scene, config: ExecutionConfig | None = None, on_step: StepHook | None = None
    ) -> None:
        """Look up the robot's joints and actuators."""
        model = scene.model
        self.config = config or ExecutionConfig()
        self._scene, self._model, self._data = scene, model, scene.data
        self._on_step = on_step
        self._arm_qpos = np.array([model.joint(name).qposadr[0] for name in ARM_JOINTS])
        self._arm_ctrl = np.array([model.actuator(name).id for name in ARM_ACTUATORS])
        self._finger_qpos = np.array([model.joint(name).qposadr[0] for name in GRIPPER_JOINTS])
        self._finger_dofs = np.array([model.joint(name).dofadr[0] for name in GRIPPER_JOINTS])
        self._finger_ctrl = model.actuator(GRIPPER_ACTUATOR).id
        self._tool_site = model.site(TOOL_SITE_NAME).id
        # A position servo lags behind a moving target by velocity * kv / kp; leading the command
        # by as much cancels it.
        gains = model.actuator_gainprm[self._arm_ctrl, 0]
        self._lead_s = -model.actuator_biasprm[self._arm_ctrl, 2] / gains

    @property
    def width_m(self) -> float:
        """Distance between the finger pads, as the robot measures it."""
        return float(self._data.qpos[self._finger_qpos].sum())

    def execute(self, plan: Plan) -> Outcome:
        """Execute a plan to its end, and judge it by the objects' motion.

        A real robot feels an empty or lost grasp by its fingers; so does this one, and then
        returns home without visiting the bin.

        Args:
            plan: What to do.

        Returns:
            The outcome; `success` says whether a target was held through lift and carry.
        """
        start_time = self._data.time
        segments = {segment.phase: segment for segment in plan.segments}
        reason, grasped = self._attempt(segments)
        check_stable(self._data)
        elapsed = self._data.time - start_time
        return Outcome(
            success=reason is Reason.GRASPED_TARGET,
            reason=reason,
            grasped=grasped,
            num_steps=round(elapsed / self._model.opt.timestep),
            simulated_s=round(elapsed, 3),
        )

    def _attempt(self, segments: dict[Phase, Segment]) -> tuple[Reason, str | None]:
        before = self._heights()
        self._move(segments[Phase.TRANSIT])
        error = self._move(segments[Phase.APPROACH])
        if error > self.config.blocked_tol_rad:
            self._go_back(segments, (Phase.APPROACH, Phase.TRANSIT))
            return Reason.APPROACH_COLLISION, None
        self._close()
        if self.width_m <= self.config.empty_width_m:
            self._go_back(segments, (Phase.APPROACH, Phase.TRANSIT))
            return Reason.EMPTY_CLOSE, None
        self._move(segments[Phase.LIFT])
        held = self._lifted_object(before)
        if held is None:
            self._move(segments[Phase.CARRY])
            self._finish(segments)
            return Reason.SLIPPED_LIFT, None
        grip = self._position_in_tool(held)
        self._move(segments[Phase.CARRY])
        slip = np.linalg.norm(self._position_in_tool(held) - grip)
        self._finish(segments)
        if slip > self.config.max_slip_m:
            return Reason.SLIPPED_CARRY, None
        is_target = held in self._scene.goal.targets
        return (Reason.GRASPED_TARGET if is_target else Reason.GRASPED_OTHER), held

    def _finish(self, segments: dict[Phase, Segment]) -> None:
        """Open over the bin and go home."""
        self._set_width(segments[Phase.RELEASE].width_m)
        self._hold(self.config.release_s)
        self._move(segments[Phase.RETURN])

    def _go_back(self, segments: dict[Phase, Segment], phases: tuple[Phase, ...]) -> None:
        """Open to what the approach had, and take the way back that the arm came."""
        self._set_width(segments[phases[0]].width_m)
        for phase in phases:
            self._move(segments[phase], reverse=True)
        self._set_width(0.0)

    def _move(self, segment: Segment, *, reverse: bool = False) -> float:
        """Follow a trajectory, fingers moving along; return the joint error at its end."""
        trajectory = segment.trajectory
        assert trajectory is not None
        step = self._model.opt.timestep
        times = np.arange(1, int(np.ceil(trajectory.duration_s / step)) + 1) * step
        qpos, qvel = trajectory.sample(trajectory.duration_s - times if reverse else times)
        commands = qpos + self._lead_s * (-qvel if reverse else qvel)
        goal = trajectory.start if reverse else trajectory.end
        for command in commands:
            self._step(command, segment.width_m)
        waited = 0.0
        while (
            self._error(goal) > self.config.arrive_tol_rad and waited < self.config.arrive_limit_s
        ):
            self._step(goal, segment.width_m)
            waited += step
        self._data.ctrl[self._arm_ctrl] = goal
        return self._error(goal)

    def _error(self, goal: np.ndarray) -> float:
        return float(np.abs(self._data.qpos[self._arm_qpos] - goal).max())

    def _step(self, arm_command: np.ndarray | None, width_m: float) -> None:
        """Advance one time step; the commanded opening moves at finite speed."""
        step = self._model.opt.timestep
        if arm_command is not None:
            self._data.ctrl[self._arm_ctrl] = arm_command
        travel = self._data.ctrl[self._finger_ctrl]
        largest = self.config.finger_speed / 2 * step
        change = np.clip(finger_travel(width_m) - travel, -largest, largest)
        self._data.ctrl[self._finger_ctrl] = travel + change
        mujoco.mj_step(self._model, self._data)
        if self._on_step is not None:
            self._on_step(self._scene)

    def _hold(self, seconds: float) -> None:
        for _ in range(round(seconds / self._model.opt.timestep)):
            self._step(None, 2 * self._data.ctrl[self._finger_ctrl])

    def _set_width(self, width_m: float) -> None:
        """Command an opening and simulate until the command has got there."""
        target = finger_travel(width_m)
        while abs(self._data.ctrl[self._finger_ctrl] - target) > 1e-9:
            self._step(None, width_m)

    def _close(self) -> None:
        """Close until the fingers stop against something or each other, or time is up."""
        step = self._model.opt.timestep
        still = waited = 0.0
        closing = True
        while closing and waited < self.config.close_limit_s:
            self._step(None, 0.0)
            speed = np.abs(self._data.qvel[self._finger_dofs]).max()
            still = still + step if speed < self.config.still_speed else 0.0
            waited += step
            closing = still < self.config.still_for_s or self._data.ctrl[self._finger_ctrl] > 0

    def _heights(self) -> dict[str, float]:
        return {item.name: self._data.xipos[item.body.body_id][2] for item in self._scene.objects}

    def _lifted_object(self, before: dict[str, float]) -> str | None:
        """Return the object that rose and is nearest to the tool, if any."""
        rises = {n: z - before[n] for n, z in self._heights().items()}
        lifted = [name for name, rise in rises.items() if rise > self.config.min_rise_m]
        return min(
            lifted, key=lambda n: float(np.linalg.norm(self._position_in_tool(n))), default=None
        )

    def _position_in_tool(self, name: str) -> np.ndarray:
        """Return an object's centre of mass (3,) in the tool frame."""
        body = next(item.body for item in self._scene.objects if item.name == name)
        offset = self._data.xipos[body.body_id] - self._data.site_xpos[self._tool_site]
        return self._data.site_xmat[self._tool_site].reshape(3, 3).T @ offset
