"""Drives arm and gripper along trajectories, and feels what a real robot feels."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from models.gripper import finger_travel
from models.robot import ARM_ACTUATORS, ARM_JOINTS, GRIPPER_ACTUATOR, GRIPPER_JOINTS, TOOL_SITE_NAME
from sr_mj.scene import Scene
from sr_mj.trajectory import Trajectory

StepHook = Callable[[Scene], None]
"""Called after every simulation step of an execution, for example to record a video."""


@dataclass(frozen=True, kw_only=True)
class DriveConfig:
    """Speeds, tolerances and limits; every time is simulated time.

    Attributes:
        finger_speed: Speed at which the commanded opening changes, m/s.
        arrive_tol_rad: Largest joint error with which a motion counts as finished.
        arrive_limit_s: Longest wait for that after a motion's nominal end.
        close_limit_s: Longest time that the fingers may take; what they press on may tremble.
        still_speed: Finger speed below which they have stopped, m/s.
        still_for_s: How long they must have stopped.
        empty_width_m: Opening at or under which nothing is between the fingers.
        empty_force_n: Force of the drive at or under which nothing is between the fingers.
    """

    finger_speed: float = 0.15
    arrive_tol_rad: float = 0.004
    arrive_limit_s: float = 0.5
    close_limit_s: float = 2.0
    still_speed: float = 0.002
    still_for_s: float = 0.06
    empty_width_m: float = 0.0015
    empty_force_n: float = 2.0


class RobotDrive:
    """Moves the robot of one scene; reads nothing but its joints and drives.

    Args:
        scene: The scene; its `data` is stepped.
        config: Speeds and tolerances.
        on_step: Called after every simulation step.
    """

    def __init__(
        self, scene: Scene, config: DriveConfig | None = None, on_step: StepHook | None = None
    ) -> None:
        """Look up joints and actuators."""
        model = scene.model
        self.config = config or DriveConfig()
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
    def arm_qpos(self) -> np.ndarray:
        """Joint angles (6,) of the arm, rad."""
        return self._data.qpos[self._arm_qpos].copy()

    @property
    def T_world_tool(self) -> np.ndarray:
        """Pose (4, 4) of the tool by the arm's joint angles."""
        pose = np.eye(4)
        pose[:3, :3] = self._data.site_xmat[self._tool_site].reshape(3, 3)
        pose[:3, 3] = self._data.site_xpos[self._tool_site]
        return pose

    @property
    def width_m(self) -> float:
        """Distance between the finger pads, as the robot measures it."""
        return float(self._data.qpos[self._finger_qpos].sum())

    @property
    def force_n(self) -> float:
        """Force of the finger drive, newtons."""
        return abs(float(self._data.actuator_force[self._finger_ctrl]))

    @property
    def feels_object(self) -> bool:
        """Whether something is between the closed fingers, by their opening and force."""
        config = self.config
        return self.width_m > config.empty_width_m and self.force_n > config.empty_force_n

    def error(self, goal: np.ndarray) -> float:
        """Return the largest deviation (rad) of the arm's joints from a posture (6,)."""
        return float(np.abs(self.arm_qpos - goal).max())

    def move(
        self,
        trajectory: Trajectory,
        width_m: float,
        *,
        reverse: bool = False,
        start_s: float = 0.0,
        guard_rad: float | None = None,
    ) -> float:
        """Follow a trajectory, fingers moving along.

        Args:
            trajectory: The motion.
            width_m: Opening to command.
            reverse: Follow it backwards.
            start_s: Part of the duration that is skipped, since it was never reached.
            guard_rad: Stop where the joints lag behind by more than this: something is touched.

        Returns:
            Seconds of the trajectory that were followed: its duration unless the guard stopped it.
        """
        step = self._model.opt.timestep
        span = trajectory.duration_s - start_s
        times = np.minimum(np.arange(1, int(np.ceil(span / step)) + 1) * step, span) + start_s
        qpos, qvel = trajectory.sample(trajectory.duration_s - times if reverse else times)
        commands = qpos + self._lead_s * (-qvel if reverse else qvel)
        for time, wanted, command in zip(times, qpos, commands, strict=True):
            self._step(command, width_m)
            if guard_rad is not None and self.error(wanted) > guard_rad:
                self._data.ctrl[self._arm_ctrl] = self.arm_qpos
                return float(time)
        self._arrive(trajectory.start if reverse else trajectory.end, width_m)
        return trajectory.duration_s

    def hold(self, seconds: float) -> None:
        """Let time pass without moving."""
        for _ in range(round(seconds / self._model.opt.timestep)):
            self._step(None, 2 * self._data.ctrl[self._finger_ctrl])

    def set_width(self, width_m: float, speed: float | None = None) -> None:
        """Command an opening and simulate until the command has got there.

        Args:
            width_m: The opening.
            speed: Speed of the change, m/s; the usual one when None.
        """
        target = finger_travel(width_m)
        while abs(self._data.ctrl[self._finger_ctrl] - target) > 1e-9:
            self._step(None, width_m, speed)

    def close(self) -> None:
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

    def let_go(self, width_m: float, speed: float) -> None:
        """Open slowly: the force fades before the pads part, so that nothing is flung.

        Args:
            width_m: The opening.
            speed: Speed of the change, m/s.
        """
        # Commands nearer to closed than this ask for more than the force limit.
        stiffness = self._model.actuator_gainprm[self._finger_ctrl, 0]
        limit = self._model.actuator_forcerange[self._finger_ctrl, 1]
        at_limit = finger_travel(self.width_m) - limit / stiffness
        self._data.ctrl[self._finger_ctrl] = max(self._data.ctrl[self._finger_ctrl], at_limit)
        self.set_width(width_m, speed)

    def _arrive(self, goal: np.ndarray, width_m: float) -> None:
        """Wait until the arm is where it was sent, or the wait has been long enough."""
        waited = 0.0
        while self.error(goal) > self.config.arrive_tol_rad and waited < self.config.arrive_limit_s:
            self._step(goal, width_m)
            waited += self._model.opt.timestep
        self._data.ctrl[self._arm_ctrl] = goal

    def _step(
        self, arm_command: np.ndarray | None, width_m: float, speed: float | None = None
    ) -> None:
        """Advance one time step; the commanded opening moves at finite speed."""
        if arm_command is not None:
            self._data.ctrl[self._arm_ctrl] = arm_command
        travel = self._data.ctrl[self._finger_ctrl]
        largest = (speed or self.config.finger_speed) / 2 * self._model.opt.timestep
        change = np.clip(finger_travel(width_m) - travel, -largest, largest)
        self._data.ctrl[self._finger_ctrl] = travel + change
        mujoco.mj_step(self._model, self._data)
        if self._on_step is not None:
            self._on_step(self._scene)
