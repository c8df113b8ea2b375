"""The robot's body at given postures: what it touches, and spheres that stand for it.

MuJoCo places the body and finds contacts of links, gripper, table and bin, exactly and at 20
microseconds a posture. For distances to a cloud of points the links' capsules become rows of
spheres, and the gripper's boxes are covered by spheres.
"""

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from sr_mj.kinematics import TOOL_SITE, build_planning_model, solid_geoms

# Between two spheres of a row a capsule stands out by at most this much.
_CAPSULE_GAP_M = 0.002
_CELLS_M = (0.012, 0.012, 0.026)
# What is held is always near these; the wrist's last capsules.
_NUM_NEAR_LINKS = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedBody:
    """The robot's body at M postures.

    Attributes:
        is_free: (M,) whether links and gripper keep clear of table, bin and each other.
        centers: (M, S, 3) centres of the links' spheres, metres.
        rotation: (M, 3, 3) orientation of the tool in the world.
        position: (M, 3) origin of the tool, metres.
    """

    is_free: np.ndarray
    centers: np.ndarray
    rotation: np.ndarray
    position: np.ndarray

    def from_tool(self, points: np.ndarray) -> np.ndarray:
        """Map points (P, 3) of the tool frame to the world, (M, P, 3)."""
        return points @ self.rotation.transpose(0, 2, 1) + self.position[:, None]

    def take(self, rows: np.ndarray) -> "PlacedBody":
        """Select postures."""
        return PlacedBody(
            is_free=self.is_free[rows],
            centers=self.centers[rows],
            rotation=self.rotation[rows],
            position=self.position[rows],
        )


class RobotBody:
    """Places the body; keeps no state between calls.

    Args:
        max_overlap_m: Overlap with table and bin that still counts as free; the fingertips of a
            low grasp may brush the table.
        self_margin_m: Distance that links and gripper keep from each other: the arm follows its
            trajectory to about a millimetre, and a link that catches on another stays there.

    Attributes:
        radius_m: (S,) radii of the links' spheres, from the shoulder to the wrist.
        is_far: (S,) which of them belong to links that the gripper does not turn with: all but the
            last two of the wrist.
    """

    def __init__(self, max_overlap_m: float = 0.001, self_margin_m: float = 0.005) -> None:
        """Compile the planning model and lay spheres along its capsules."""
        self._max_overlap_m, self._self_margin_m = max_overlap_m, self_margin_m
        self._model = build_planning_model()
        robot, _ = solid_geoms(self._model)
        self._is_robot = np.isin(np.arange(self._model.ngeom), robot)
        self._model.geom_margin[robot] = self_margin_m
        self._data = mujoco.MjData(self._model)
        self._site = self._model.site(TOOL_SITE).id
        capsules = np.flatnonzero(self._model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE)
        rows = [_along_capsule(*self._model.geom_size[geom, :2]) for geom in capsules]
        self._geom = np.repeat(capsules, [len(row) for row in rows])
        self._along = np.concatenate(rows)
        self.radius_m = self._model.geom_size[self._geom, 0]
        self.is_far = ~np.isin(self._geom, capsules[-_NUM_NEAR_LINKS:])

    def place(self, qpos: np.ndarray) -> PlacedBody:
        """Place the body.

        Args:
            qpos: (M, 6) joint angles, rad.

        Returns:
            Where it is and whether it is free.
        """
        data = self._data
        is_free = np.empty(len(qpos), bool)
        centers = np.empty((len(qpos), len(self._geom), 3))
        rotation, position = np.empty((len(qpos), 9)), np.empty((len(qpos), 3))
        for row, posture in enumerate(qpos):
            is_free[row] = self._put(posture)
            axis = data.geom_xmat[self._geom, 2::3]
            centers[row] = data.geom_xpos[self._geom] + self._along[:, None] * axis
            rotation[row], position[row] = data.site_xmat[self._site], data.site_xpos[self._site]
        return PlacedBody(
            is_free=is_free,
            centers=centers,
            rotation=rotation.reshape(-1, 3, 3),
            position=position,
        )

    def is_free(self, qpos: np.ndarray) -> np.ndarray:
        """Tell which postures (M, 6) keep clear of table, bin and the robot itself, (M,)."""
        return np.fromiter(map(self._put, qpos), bool, len(qpos))

    def _put(self, posture: np.ndarray) -> bool:
        """Put the body in a posture; tell whether it keeps clear of table, bin and itself."""
        self._data.qpos[:] = posture
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        if not self._data.ncon:
            return True
        contact = self._data.contact
        is_own = self._is_robot[contact.geom].all(axis=1)
        least = np.where(is_own, self._self_margin_m, -self._max_overlap_m)
        return bool((contact.dist >= least).all())


@dataclass(frozen=True, kw_only=True)
class GripperBody:
    """The gripper at one opening, in the tool frame.

    Attributes:
        opening_m: Distance between the pads.
    """

    opening_m: float = ROBOTIQ_2F85_CLASS.max_width_m

    @cached_property
    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (3, 3) and half extents (3, 3): two fingers, then the palm."""
        return ROBOTIQ_2F85_CLASS.boxes(self.opening_m)

    @cached_property
    def spheres(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (G, 3), radii (G,) of spheres that cover the boxes, at most 10 mm too large."""
        centers, halves = self.boxes
        parts = [_cover_box(*box) for box in zip(centers, halves, _CELLS_M, strict=True)]
        return np.concatenate([c for c, _ in parts]), np.concatenate([r for _, r in parts])


def _cover_box(center: np.ndarray, half: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Cut a box into cells and circumscribe those at its surface."""
    counts = np.ceil(2 * half / cell).astype(int)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    outer = ((cells == 0) | (cells == counts - 1)).any(axis=1)
    edge = 2 * half / counts
    centers = center - half + (cells[outer] + 0.5) * edge
    return centers, np.full(len(centers), np.linalg.norm(edge) / 2)


def _along_capsule(radius: float, half: float) -> np.ndarray:
    """Places along a capsule's axis at which its spheres stand, metres from its middle."""
    step = 2 * np.sqrt(radius**2 - (radius - _CAPSULE_GAP_M) ** 2)
    return np.linspace(-half, half, max(int(np.ceil(2 * half / step)), 1) + 1)
