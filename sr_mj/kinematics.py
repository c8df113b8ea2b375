"""Inverse kinematics of the arm with mink, in a model of what the robot knows for certain.

That model holds the robot, the table and the bin, the gripper as rigid open boxes. It never sees
the scene's objects; the planner checks its paths against the cloud of points.
"""

from dataclasses import dataclass

import mink
import mujoco
import numpy as np
from dm_control import mjcf

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from models.robot import ARM_JOINTS, ROBOT_PREFIX
from models.tabletop import TABLE_GEOM, build_tabletop
from models.ur5 import MAX_JOINT_SPEED, TOOL_FLANGE_SITE, build_ur5

TOOL_SITE = f"{ROBOT_PREFIX}gripper/tool"
"""Name of the tool's site in the planning model."""

_SOLVER = "daqp"
# At full speed no joint turns farther in a step than the solver sees collisions coming.
_DT = 0.04


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
        avoid_m: Distance from which on the solver slows links, gripper, table and bin down when
            they near each other.
    """

    max_iterations: int = 60
    position_tol_m: float = 5e-4
    angle_tol_rad: float = 2e-3
    posture_cost: float = 1e-4
    max_overlap_m: float = 0.001
    avoid_m: float = 0.12


def build_planning_model() -> mujoco.MjModel:
    """Compile arm, rigid open gripper, table and bin: six degrees of freedom."""
    geometry = ROBOTIQ_2F85_CLASS
    arm = build_ur5()
    flange = arm.find("site", TOOL_FLANGE_SITE)
    gripper = mjcf.RootElement(model="gripper")
    body = gripper.worldbody.add("body", name="gripper", pos=(0, 0, geometry.flange_to_tool_m))
    for center, half in zip(*geometry.boxes(geometry.max_width_m), strict=True):
        body.add("geom", type="box", pos=center, size=half, mass=0.3)
    body.add("site", name=TOOL_SITE.rpartition("/")[2])
    flange.attach(gripper)
    root = build_tabletop("planning")
    root.attach(arm)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def solid_geoms(model: mujoco.MjModel) -> tuple[list[int], list[int]]:
    """List the geoms of the robot that can collide, and those of table and bin."""
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    robot = np.flatnonzero((model.geom_bodyid > model.body("bin").id) & (model.geom_contype > 0))
    fixed = [i for i, name in enumerate(names) if name == TABLE_GEOM or name.startswith("bin_")]
    return robot.tolist(), fixed


class ArmKinematics:
    """Solves IK for the tool and checks postures; keeps no state between calls.

    Args:
        config: Tolerances and limits.
    """

    def __init__(self, config: IkConfig | None = None) -> None:
        """Compile the planning model and set up mink's tasks and limits."""
        self.config = config or IkConfig()
        self._model = build_planning_model()
        self._configuration = mink.Configuration(self._model)
        self._frame_task = mink.FrameTask(
            TOOL_SITE, "site", position_cost=1.0, orientation_cost=0.3, lm_damping=1e-6
        )
        self._posture_task = mink.PostureTask(self._model, cost=self.config.posture_cost)
        robot, fixed = solid_geoms(self._model)
        self._limits = [
            mink.ConfigurationLimit(self._model),
            mink.VelocityLimit(self._model, dict.fromkeys(ARM_JOINTS, MAX_JOINT_SPEED)),
            mink.CollisionAvoidanceLimit(
                self._model,
                [(robot, fixed), (robot, robot)],
                minimum_distance_from_collisions=-self.config.max_overlap_m,
                collision_detection_distance=self.config.avoid_m,
            ),
        ]

    def tool_pose(self, qpos: np.ndarray) -> np.ndarray:
        """Return the (4, 4) pose of the tool for joint angles (6,)."""
        self._configuration.update(np.asarray(qpos, float))
        return self._configuration.get_transform_frame_to_world(TOOL_SITE, "site").as_matrix()

    def solve(self, T_world_tool: np.ndarray, start: np.ndarray) -> np.ndarray | None:
        """Solve IK from one start posture.

        Args:
            T_world_tool: (4, 4) pose to reach.
            start: (6,) joint angles, rad; also the posture to stay near.

        Returns:
            (6,) joint angles within the joint limits, or None if the pose was not reached: it is
            out of reach, or links, gripper, table or bin are in each other's way.
        """
        self._configuration.update(np.asarray(start, float))
        self._frame_task.set_target(mink.SE3.from_matrix(np.asarray(T_world_tool, float)))
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

    def follow(
        self, Ts_world_tool: np.ndarray, start: np.ndarray, max_joint_step: float
    ) -> np.ndarray | None:
        """Follow a path of the tool from a posture that has reached its first pose.

        Args:
            Ts_world_tool: (P, 4, 4) poses, close to each other.
            start: (6,) posture at the first pose, rad.
            max_joint_step: Largest joint motion between two poses, rad; more means that the arm
                would flip from one branch of postures to another.

        Returns:
            (P, 6) postures, or None if a pose was not reached.
        """
        path = [np.asarray(start, float)]
        for pose in Ts_world_tool[1:]:
            posture = self.solve(pose, path[-1])
            if posture is None or np.abs(posture - path[-1]).max() > max_joint_step:
                return None
            path.append(posture)
        return np.array(path)
