"""The privileged policy: it knows where every object is. The ceiling of every other policy."""

import numpy as np
from scipy.spatial import KDTree

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from policy.actions import ActionCandidates, ActionScores
from policy.observation import Observation
from sr_mj.scene import Scene, SceneObject

_ON_TARGET = 10.0
_SIDE_MARGIN_M = 0.004
_MIN_POINTS = 3


def _surface_points(item: SceneObject) -> np.ndarray:
    """Return vertices and face centres (P, 3) of an object's mesh in its own frame."""
    corners = item.asset.vertices[item.asset.faces]
    return np.concatenate([item.asset.vertices, corners.mean(axis=1)])


class OraclePolicy:
    """Chooses, by ground truth, a grasp that closes on a target, else one that clears the way.

    A candidate that would close on an object of the target set beats every other; among those,
    the geometric prior decides. If there is none, the candidate nearest to a target wins: it most
    likely removes what lies on it or beside it. Privileged: it reads object poses and the target
    set, which no real robot has.

    Args:
        scene: The scene that is acted in; read at every decision.
    """

    name = "oracle"

    def __init__(self, scene: Scene) -> None:
        """Collect the objects' surfaces."""
        self._scene = scene
        self._surfaces = {item.name: _surface_points(item) for item in scene.objects}

    def score(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> ActionScores:
        """Score candidates by ground truth; the observation is not used.

        Args:
            observation: Ignored.
            candidates: K grasps.
            rng: Ignored.

        Returns:
            Logits: 10 + prior on a target, otherwise prior - distance to the nearest target in
            decimetres.
        """
        targets = self._scene.goal.targets
        if not len(candidates) or not targets:
            return ActionScores(logits=candidates.prior)
        names = list(self._surfaces)
        grips = np.stack([self._points_between_fingers(n, candidates) for n in names])
        on_target = np.isin(np.array(names)[grips.argmax(axis=0)], targets)
        on_target &= grips.max(axis=0) >= _MIN_POINTS
        distance = np.min([self._distance(name, candidates.positions) for name in targets], axis=0)
        bonus = np.where(on_target, _ON_TARGET, -10 * distance)
        return ActionScores(logits=(candidates.prior + bonus).astype(np.float32))

    def _world_points(self, name: str) -> np.ndarray:
        pose = self._scene.T_world_object(name)
        return self._surfaces[name] @ pose[:3, :3].T + pose[:3, 3]

    def _points_between_fingers(self, name: str, candidates: ActionCandidates) -> np.ndarray:
        """Count an object's surface points in the space that each candidate's pads sweep (K,)."""
        rotations, origins = candidates.Ts_world_tool[:, :3, :3], candidates.positions
        points = self._world_points(name)
        local = (
            np.einsum("pi,kij->kpj", points, rotations)
            - np.einsum("ki,kij->kj", origins, rotations)[:, None]
        )
        pad_y, pad_z = ROBOTIQ_2F85_CLASS.pad_half_m
        half = np.stack(
            [
                candidates.width_m / 2 + _SIDE_MARGIN_M,
                np.full(len(candidates), pad_y),
                np.full(len(candidates), pad_z),
            ],
            axis=1,
        )
        return np.all(np.abs(local) <= half[:, None], axis=2).sum(axis=1)

    def _distance(self, name: str, positions: np.ndarray) -> np.ndarray:
        """Return the distances (K,) of positions to an object's surface, metres."""
        return KDTree(self._world_points(name)).query(positions)[0]
