"""How far postures keep clear of everything that the robot knows of."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.distance import cdist

from models.tabletop import BIN_CENTER, BIN_HALF_M, BIN_HEIGHT_M
from sr_mj.candidates.collision import hits_points
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.surface import thin
from sr_mj.candidates.threads import single_threaded
from sr_mj.planning.body import GripperBody, PlacedBody, RobotBody
from sr_mj.planning.obstacles import Obstacles

# A held object as spheres: one a voxel, of half its edge.
_HELD_VOXEL_M = 0.012
# The bin's walls, with some room.
_WALL_M = 0.015
_OPEN = GripperBody()
_WRIST = AntipodalConfig()


@dataclass(frozen=True, kw_only=True, eq=False)
class Clearance:
    """Measures postures against robot, table, bin and cloud.

    Attributes:
        body: Places the robot.
        obstacles: The cloud; None if there is nothing to hit.
        held_points: (P, 3) points of a held object in the tool frame; none for an empty gripper.
        with_gripper: Whether the gripper counts; not while it is among the points on purpose.
    """

    body: RobotBody
    obstacles: Obstacles | None = None
    held_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    with_gripper: bool = True

    def measure(self, qpos: np.ndarray) -> np.ndarray:
        """Measure distances to the cloud.

        Args:
            qpos: (M, 6) joint angles, rad.

        Returns:
            (M,) metres, for the held object also to table, bin and arm; minus infinity where links,
            gripper, table and bin collide, and infinity where there is no cloud.
        """
        qpos = np.asarray(qpos, float).reshape(-1, 6)
        if self.obstacles is None and not len(self.held_points):
            return np.where(self.body.is_free(qpos), np.inf, -np.inf)
        placed = self.body.place(qpos)
        clear = np.full(len(qpos), np.inf)
        rows = np.flatnonzero(placed.is_free)
        if len(rows):
            clear[rows] = self._distances(placed.take(rows))
        return np.where(placed.is_free, clear, -np.inf)

    def _distances(self, placed: PlacedBody) -> np.ndarray:
        parts = [(placed.centers, self.body.radius_m)]
        if self.with_gripper:
            centers, radii = _OPEN.spheres
            parts.append((placed.from_tool(centers), radii))
        clear = np.full(len(placed.is_free), np.inf)
        if len(self.held_points):
            held = placed.from_tool(self.held_points)
            parts.append((held, np.full(len(self.held_points), _HELD_VOXEL_M / 2)))
            clear = np.minimum(_over_table_and_bin(held), self._from_arm(placed, held))
        if self.obstacles is None:
            return clear
        centers = np.concatenate([centers for centers, _ in parts], axis=1)
        radii = np.concatenate([radii for _, radii in parts])
        return np.minimum(clear, (self.obstacles.distances(centers) - radii).min(axis=1))

    def _from_arm(self, placed: PlacedBody, held: np.ndarray) -> np.ndarray:
        """Least distances (M,) of a held object's spheres (M, P, 3) from the arm's links."""
        links, radii = placed.centers[:, self.body.is_far], self.body.radius_m[self.body.is_far]
        gaps = np.empty(len(held))
        for row, (points, centers) in enumerate(zip(held, links, strict=True)):
            gaps[row] = (cdist(points, centers) - radii).min()
        return gaps - _HELD_VOXEL_M / 2


def gripper_hits(
    obstacles: Obstacles | None, Ts_world_tool: np.ndarray, opening_m: float, touch_m: float
) -> bool:
    """Test the gripper's boxes and the wrist against the cloud along a path.

    The space between the fingers does not count: what is there will be, or was, grasped.

    Args:
        obstacles: The cloud; None if there is nothing to hit.
        Ts_world_tool: (P, 4, 4) poses of the tool.
        opening_m: Distance between the pads.
        touch_m: How far points may reach into the boxes.

    Returns:
        Whether points reach farther into a box at any of the poses.
    """
    if obstacles is None:
        return False
    centers, halves = GripperBody(opening_m=opening_m).boxes
    wrist = np.array([*_WRIST.wrist_half_m, _WRIST.wrist_length_m / 2])
    flange = centers[2, 2] - halves[2, 2]
    centers = np.vstack([centers, [0, 0, flange - wrist[2]]])
    halves = np.vstack([halves, wrist]) - touch_m
    shape = (len(Ts_world_tool), 4, 3)
    low = np.broadcast_to(centers - halves, shape).astype(np.float32)
    high = np.broadcast_to(centers + halves, shape).astype(np.float32)
    with single_threaded():
        return bool(hits_points(Ts_world_tool, low, high, obstacles.points).any())


def held_spheres(points_tool: np.ndarray) -> np.ndarray:
    """Thin the points (N, 3) of a held object to the centres (P, 3) of spheres."""
    return thin(points_tool, _HELD_VOXEL_M).astype(float)


def _over_table_and_bin(points: np.ndarray) -> np.ndarray:
    """Least height (M,) of points (M, P, 3) over table and bin walls, metres."""
    from_wall = np.abs(points[..., :2] - BIN_CENTER[:2]).max(axis=-1) - BIN_HALF_M
    return (points[..., 2] - BIN_HEIGHT_M * (np.abs(from_wall) < _WALL_M)).min(axis=1)
