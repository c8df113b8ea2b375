"""Says what became of the objects: ground truth, for outcomes and the oracle only."""

import numpy as np
import shapely
from scipy.spatial import KDTree

from models.robot import GRIPPER_JOINTS, TOOL_SITE_NAME
from models.tabletop import BIN_CENTER, BIN_HALF_M
from sr_mj.outcome import Reason
from sr_mj.scene import Scene
from sr_mj.scene.placement import (
    RING_M,
    PlaceRegion,
    find_object,
    footprint,
    is_placed,
    place_region,
)

_FELL_M = -0.02
_TOPPLED_RAD = np.radians(30)
_CALM_LINEAR, _CALM_ANGULAR = 0.002, 0.1  # m/s and rad/s
# Nothing counts as missed by less than what a polygon's corners cut off a circle.
_TOUCHED_MISS_M = 1e-3


def touching_fingers(scene: Scene) -> dict[str, set[int]]:
    """Name the objects that touch a finger, and which fingers (their body ids) each touches."""
    fingers = [int(scene.model.joint(name).bodyid[0]) for name in GRIPPER_JOINTS]
    names = {item.body.body_id: item.name for item in scene.objects}
    touched: dict[str, set[int]] = {}
    # The robot never sleeps, so that its contacts are all there.
    for pair in scene.model.geom_bodyid[scene.data.contact.geom[: scene.data.ncon]]:
        for body, other in (pair, pair[::-1]):
            if int(body) in fingers and int(other) in names:
                touched.setdefault(names[int(other)], set()).add(int(body))
    return touched


def object_in_gripper(scene: Scene) -> str | None:
    """Name what the closed gripper holds clear of the table; None if it is empty.

    That is the object that both fingers touch, or, of two objects that are pressed against each
    other between them, the one that is asked for.
    """
    tool, touched = scene.data.site(TOOL_SITE_NAME).xpos, touching_fingers(scene)
    num_fingers = len(set[int]().union(*touched.values()))
    if num_fingers < 2:
        return None
    return min(
        touched,
        key=lambda name: (
            len(touched[name]) < 2,
            name not in scene.goal.targets,
            float(np.linalg.norm(_center(scene, name) - tool)),
        ),
    )


def _center(scene: Scene, name: str) -> np.ndarray:
    """Return an object's centre of mass (3,) in the world."""
    return scene.data.xipos[find_object(scene, name).body.body_id].copy()


class Judge:
    """Compares the objects' state after an attempt with that before.

    Args:
        scene: The scene; its state is read.
    """

    def __init__(self, scene: Scene) -> None:
        """Take note of the present state."""
        self._scene = scene
        self._start = self._centers()
        self._targets = {n: scene.T_world_object(n) for n in scene.goal.targets}
        self._release = np.eye(3)
        self._regions: tuple[PlaceRegion, ...] = ()

    def lifted_object(self, rise_m: float) -> str | None:
        """Return the object that rose by more than `rise_m` in the gripper's fingers.

        If they hold none that rose, that is the one nearest to the tool: something else may be
        between what rose and a finger. What lies on a held object is not held.
        """
        lifted = [n for n, c in self._centers().items() if c[2] - self._start[n][2] > rise_m]
        if (held := object_in_gripper(self._scene)) in lifted:
            return held
        return min(
            lifted, key=lambda n: float(np.linalg.norm(self.position_in_tool(n))), default=None
        )

    def position_in_tool(self, name: str) -> np.ndarray:
        """Return an object's centre of mass (3,) in the tool frame."""
        tool = self._scene.data.site(TOOL_SITE_NAME)
        return tool.xmat.reshape(3, 3).T @ (_center(self._scene, name) - tool.xpos)

    def knocked_off(self, held: str | None) -> tuple[str, ...]:
        """Name the objects, except one, that have left the workspace since the start."""
        after = self._centers()
        return tuple(
            name
            for name in after
            if name != held and self._is_inside(self._start[name]) and self._has_left(after[name])
        )

    def grasp_reward(self, position: np.ndarray) -> float:
        """Return the reward of a grasp at a position (3,) that did not bring a target."""
        if not self._targets:
            return -1.0
        distance = min(self._distance(name, position) for name in self._targets)
        return -min(distance / self._scene.workspace.diagonal_m, 1.0)

    def begin_place(self, moved: str | None) -> None:
        """Fix where an object may be put, before anything is moved."""
        place = self._scene.goal.place
        if place is not None:
            self._regions = tuple(
                place_region(self._scene, place.relation, reference, moved=moved)
                for reference in place.references
            )

    def begin_release(self, moved: str) -> None:
        """Take note of how an object is held just before it is let go."""
        self._release = self._scene.T_world_object(moved)[:3, :3].copy()

    def is_calm(self, name: str | None = None) -> bool:
        """Tell whether one object, or every one that is in the workspace, lies still."""
        items = [
            item
            for item in self._scene.objects
            if item.name == name
            or (name is None and self._is_inside(_center(self._scene, item.name)))
        ]
        speed = np.array([self._scene.data.qvel[item.body.qvel] for item in items]).reshape(-1, 6)
        still = np.all(np.abs(speed[:, :3]) < _CALM_LINEAR, axis=1)
        still &= np.all(np.abs(speed[:, 3:]) < _CALM_ANGULAR, axis=1)
        return bool(np.all(still))

    def place_reason(self, moved: str) -> Reason:
        """Say how the placing of an object ended, once everything is calm, or has had its time."""
        if self._has_left(_center(self._scene, moved)):
            return Reason.KNOCKED_OFF
        if not self.is_calm(moved):
            return Reason.TIMED_OUT
        if any(is_placed(self._scene, moved, region) for region in self._regions):
            return Reason.PLACED
        turn = self._scene.T_world_object(moved)[:3, :3] @ self._release.T
        # How far the vertical moved; a turn about it is no topple.
        tilt = np.arccos(np.clip(turn[2, 2], -1, 1))
        return Reason.TOPPLED if tilt > _TOPPLED_RAD else Reason.WRONG_REGION

    def missed_m(self, moved: str) -> float | None:
        """Return the distance from an object to the nearest valid place; None without regions.

        An object that is where it should be, but touches what it should not, lies outside the
        workspace or still moves, has missed by 1 mm.
        """
        if not self._regions:
            return None
        gaps = []
        may_count = self.is_calm(moved) and not self._has_left(_center(self._scene, moved))
        for region in self._regions:
            if may_count and is_placed(self._scene, moved, region):
                return 0.0
            gap = self._gap(region, shapely.Point(_center(self._scene, moved)[:2]))
            gaps.append(max(gap, _TOUCHED_MISS_M))
        return min(gaps)

    def _gap(self, region: PlaceRegion, point: shapely.Point) -> float:
        outline = footprint(self._scene, region.reference)
        if region.is_inside:
            return float(shapely.distance(outline, point))
        distance = float(shapely.distance(outline, point))
        return max(RING_M[0] - distance, distance - RING_M[1], 0.0)

    def _distance(self, name: str, position: np.ndarray) -> float:
        """Return the distance of a position to a target's nearest vertex at the start."""
        vertices, pose = find_object(self._scene, name).asset.vertices, self._targets[name]
        return float(KDTree(vertices @ pose[:3, :3].T + pose[:3, 3]).query(position)[0])

    def _centers(self) -> dict[str, np.ndarray]:
        return {item.name: _center(self._scene, item.name) for item in self._scene.objects}

    def _is_inside(self, center: np.ndarray) -> bool:
        return bool(self._scene.workspace.contains_xy(center)) and center[2] > _FELL_M

    def _has_left(self, center: np.ndarray) -> bool:
        """Tell whether an object lies outside the workspace, and not in the bin either."""
        in_bin = np.all(np.abs(center[:2] - BIN_CENTER[:2]) < BIN_HALF_M) and center[2] > _FELL_M
        return not self._is_inside(center) and not in_bin
