"""Inverse kinematics of the arm with mink, and collision checks of arm postures.

The planner owns a model of what the robot knows of its surroundings: itself, the table and the
bin, the gripper as rigid boxes. It never sees the scene's objects; those are kept clear by the
candidate generator's checks against the cloud and by carrying everything over the heap.
"""

from dataclasses import dataclass

import mink
import mujoco
import numpy as np
from dm_control import mjcf

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.robot import ARM_JOINTS, ROBOT_PREFIX
from models.tabletop import build_tabletop
from models.ur5 import HOME_QPOS, TOOL_FLANGE_SITE, build_ur5

_TOOL_SITE = "tool"
_SOLVER = "daqp"
_DT = 0.1


@dataclass(frozen=True, kw_only=True)
class IkConfig:
    """When a pose counts as reached, and how long to try.

    Attributes:
        max_iterations: Differential IK steps from one start posture.
        position_tol_m: Largest position error of a solution.
        angle_tol_rad: Largest orientation error of a solution.
        posture_cost: Weight of staying near the start posture; small, so that it decides only
            between postures that reach the pose equally well.
        max_overlap_m: Overlap of links, gripper, table and bin that still counts as free; the
            fingertips of a low grasp may brush the table.
    """

    max_iterations: int = 60
    position_tol_m: float = 5e-4
    angle_tol_rad: float = 2e-3
    posture_cost: float = 1e-4
    max_overlap_m: float = 0.001


def _build_planning_model() -> mujoco.MjModel:
    """Compile arm, rigid open gripper, table and bin: six degrees of freedom."""
    geometry = ROBOTIQ_2F85_CLASS
    arm = build_ur5()
    flange = arm.find("site", TOOL_FLANGE_SITE)
    gripper = mjcf.RootElement(model="gripper")
    body = gripper.worldbody.add("body", name="gripper", pos=(0, 0, geometry.flange_to_tool_m))
    for center, half in zip(*geometry.boxes(geometry.max_width_m), strict=True):
        body.add("geom", type="box", pos=center, size=half, mass=0.3)
    body.add("site", name=_TOOL_SITE)
    flange.attach(gripper)
    root = build_tabletop("planning")
    root.attach(arm)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


class ArmKinematics:
    """Solves IK for the tool and checks postures; keeps no state between calls.

    Args:
        config: Tolerances and limits.
    """

    def __init__(self, config: IkConfig | None = None) -> None:
        """Compile the planning model."""
        self.config = config or IkConfig()
        self._model = _build_planning_model()
        self._configuration = mink.Configuration(self._model)
        self._site = f"{ROBOT_PREFIX}gripper/{_TOOL_SITE}"
        self._frame_task = mink.FrameTask(
            self._site, "site", position_cost=1.0, orientation_cost=0.3, lm_damping=1e-6
        )
        self._posture_task = mink.PostureTask(self._model, cost=self.config.posture_cost)
        self._limits = [
            mink.ConfigurationLimit(self._model),
            mink.VelocityLimit(self._model, dict.fromkeys(ARM_JOINTS, 2 * np.pi)),
        ]

    def tool_pose(self, qpos: np.ndarray) -> np.ndarray:
        """Return the (4, 4) pose of the tool for joint angles (6,)."""
        self._configuration.update(np.asarray(qpos, float))
        return self._configuration.get_transform_frame_to_world(self._site, "site").as_matrix()

    def solve(self, T_world_tool: np.ndarray, start: np.ndarray) -> np.ndarray | None:
        """Solve IK from one start posture.

        Args:
            T_world_tool: (4, 4) pose to reach.
            start: (6,) joint angles, rad; also the posture to stay near.

        Returns:
            (6,) joint angles within the joint limits, or None if the pose was not reached.
        """
        target = mink.SE3.from_matrix(np.asarray(T_world_tool, float))
        self._configuration.update(np.asarray(start, float))
        self._frame_task.set_target(target)
        self._posture_task.set_target(np.asarray(start, float))
        tasks = [self._frame_task, self._posture_task]
        for _ in range(self.config.max_iterations):
            error = self._frame_task.compute_error(self._configuration)
            if (
                np.linalg.norm(error[:3]) < self.config.position_tol_m
                and np.linalg.norm(error[3:]) < self.config.angle_tol_rad
            ):
                return self._configuration.q.copy()
            try:
                velocity = mink.solve_ik(
                    self._configuration, tasks, _DT, _SOLVER, limits=self._limits
                )
            except mink.NoSolutionFound:
                return None
            self._configuration.integrate_inplace(velocity, _DT)
        return None

    def solve_any(self, T_world_tool: np.ndarray) -> list[np.ndarray]:
        """Solve IK from several start postures, elbow up, facing the pose.

        Args:
            T_world_tool: (4, 4) pose to reach.

        Returns:
            Distinct solutions (6,) free of collision, nearest to home first; empty if the pose
            cannot be reached.
        """
        solutions: list[np.ndarray] = []
        for start in self._start_postures(T_world_tool):
            solution = self.solve(T_world_tool, start)
            if solution is None or not self.is_free(solution):
                continue
            if all(np.abs(solution - other).max() > 0.1 for other in solutions):
                solutions.append(solution)
        return sorted(solutions, key=lambda q: float(np.abs(q - HOME_QPOS).max()))

    def is_free(self, qpos: np.ndarray) -> bool:
        """Tell whether a posture (6,) collides neither with table, bin nor the robot itself."""
        self._configuration.update(np.asarray(qpos, float))
        data = self._configuration.data
        mujoco.mj_collision(self._model, data)
        return not np.any(data.contact.dist[: data.ncon] < -self.config.max_overlap_m)

    def _start_postures(self, T_world_tool: np.ndarray) -> list[np.ndarray]:
        """Return start postures whose pan joint already faces the pose, wrist turned both ways."""
        x, y = T_world_tool[:2, 3]
        # The tool hangs 0.109 m beside the plane of upper arm and forearm.
        pan = np.arctan2(y, x) - np.arcsin(np.clip(0.10915 / max(np.hypot(x, y), 0.12), -1, 1))
        reach = np.array([pan, -0.55 * np.pi, 0.55 * np.pi, -0.5 * np.pi, -0.5 * np.pi, 0.0])
        # Yaw of the tool's x axis about the vertical fixes the last joint.
        yaw = np.arctan2(T_world_tool[1, 0], T_world_tool[0, 0])
        wrist = (pan - np.pi / 2 - yaw + np.pi) % (2 * np.pi) - np.pi
        return [np.r_[reach[:5], wrist + turn] for turn in (0.0, np.sign(-wrist or 1) * 2 * np.pi)]
