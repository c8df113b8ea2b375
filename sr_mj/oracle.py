"""The privileged policy: it knows where every object is. The ceiling of every other policy."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from policy.actions import ActionCandidates, ActionScores
from policy.observation import Observation
from sr_mj.judge import object_in_gripper
from sr_mj.oracle_drop import rule_out_falls
from sr_mj.oracle_place import score_places
from sr_mj.scene import Scene, SceneObject
from sr_mj.scene.placement import find_object, objects_on

_ON_TARGET = 10.0
_SIDE_MARGIN_M = 0.004
_MIN_POINTS = 3
# Two things gripped at once are both carried off, and what is put down is not alone.
_SHARED = -1.0
# What lies on a target comes along, and is put down with it: it is taken away first.
_LOADED, _UNLOADS = -3.0, 8.5
# An object that is held beside its centre of mass turns between the fingers on the way; at this
# distance that costs as much as half of the prior.
_LEVER_SCALE_M, _LEVER = 0.06, -0.5


def _surface_points(item: SceneObject) -> np.ndarray:
    """Return vertices and face centres (P, 3) of an object's mesh in its own frame."""
    corners = item.asset.vertices[item.asset.faces]
    return np.concatenate([item.asset.vertices, corners.mean(axis=1)])


class OraclePolicy:
    """Chooses by ground truth: a grasp that closes on a target, a place well inside the region.

    Picking, a candidate that would close on an object of the target set beats every other; among
    those, the geometric prior decides, less for what would be gripped along with it and, where it
    is to be placed, for its weight beside the fingers; there, what lies on a target is taken away
    before it. If there is none, the candidate nearest to
    a target wins: it most likely removes what lies on it or beside it. Placing, the place deepest
    inside the region wins at which the object, let fall in a copy of the scene, stays; see
    `score_places`. Privileged: it reads object poses and the goal's objects, which no real robot
    can.

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
            candidates: K grasps or places.
            rng: Ignored.

        Returns:
            Logits. Of grasps: 10 + prior on a target, less 1 where another object is between the
            fingers too; if it is to be placed, less up to 0.5 for a lever, and less 3 where
            something lies on it, on which a grasp gets 8.5 + prior; otherwise prior - distance to
            the nearest target in decimetres. Of places: see `score_places`.
        """
        if candidates.kind == "place":
            moved = object_in_gripper(self._scene)
            if moved is None:
                return ActionScores(logits=candidates.prior)
            scores = score_places(self._scene, moved, candidates)
            if self._scene.goal.place is not None and self._scene.goal.place.references:
                scores = rule_out_falls(self._scene, moved, candidates, scores, _ON_TARGET)
            return ActionScores(logits=scores)
        targets = self._scene.goal.targets
        if not len(candidates) or not targets:
            return ActionScores(logits=candidates.prior)
        gripped, is_shared = self._grips(candidates)
        on_target = np.isin(gripped, targets)
        gain = _ON_TARGET + _SHARED * is_shared
        if self._scene.goal.place is not None:
            # What is not gripped has no lever; any name will do there.
            held = np.where(on_target, gripped, targets[0])
            gain = gain + _LEVER * self._levers(held, candidates)
            on_loaded, on_load = self._loads(gripped)
            gain = np.where(on_load & ~on_target, _UNLOADS, gain + _LOADED * on_loaded)
            on_target |= on_load
        distance = self.distances(targets, candidates.positions)
        bonus = np.where(on_target, gain, -10 * distance)
        return ActionScores(logits=(candidates.prior + bonus).astype(np.float32))

    def gripped(self, candidates: ActionCandidates) -> np.ndarray:
        """Tell what grasps would close on.

        Args:
            candidates: K grasps.

        Returns:
            (K,) names of objects; "" for nothing.
        """
        return self._grips(candidates)[0]

    def distances(self, names: Sequence[str], positions: np.ndarray) -> np.ndarray:
        """Measure how far points are from the nearest of some objects.

        Args:
            names: At least one object.
            positions: (N, 3) world, metres.

        Returns:
            (N,) distances to the surface, metres.
        """
        trees = [KDTree(self._world_points(name)) for name in names]
        return np.min([tree.query(positions)[0] for tree in trees], axis=0)

    def _grips(self, candidates: ActionCandidates) -> tuple[np.ndarray, np.ndarray]:
        """Return (K,) names of what grasps close on, "" for nothing, and whether on more too."""
        names = list(self._surfaces)
        counts = np.stack([self._points_between_fingers(name, candidates) for name in names])
        is_gripped = counts >= _MIN_POINTS
        most = np.array(names)[counts.argmax(axis=0)]
        return np.where(is_gripped.any(axis=0), most, ""), is_gripped.sum(axis=0) > 1

    def _levers(self, names: np.ndarray, candidates: ActionCandidates) -> np.ndarray:
        """Rate (K,) in 0..1 the lever by which gravity turns each gripped object in the pads."""
        bodies = [find_object(self._scene, str(name)).body.body_id for name in names]
        offset = self._scene.data.xipos[bodies] - candidates.positions
        closing = candidates.Ts_world_tool[:, :3, 0]
        # The torque of the weight about the axis through both pads, over the weight.
        lever = np.abs(closing[:, 0] * offset[:, 1] - closing[:, 1] * offset[:, 0])
        return (lever / _LEVER_SCALE_M).clip(0, 1)

    def _loads(self, gripped: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tell which grasps are on targets that carry something, and which on what they carry.

        What the target is to be put by must stay.
        """
        goal = self._scene.goal
        kept = () if goal.place is None else goal.place.references
        carried = {
            target: set(objects_on(self._scene, target)).difference(kept) for target in goal.targets
        }
        loads = set[str]().union(*carried.values())
        loaded = [target for target, load in carried.items() if load]
        return np.isin(gripped, loaded), np.isin(gripped, sorted(loads))

    def _world_points(self, name: str) -> np.ndarray:
        pose = self._scene.T_world_object(name)
        return self._surfaces[name] @ pose[:3, :3].T + pose[:3, 3]

    def _points_between_fingers(self, name: str, candidates: ActionCandidates) -> np.ndarray:
        """Count an object's surface points in the space that each candidate's pads sweep (K,)."""
        pad_y, pad_z = ROBOTIQ_2F85_CLASS.pad_half_m
        half_x = candidates.width_m.astype(float) / 2 + _SIDE_MARGIN_M
        points, reach = self._world_points(name), np.sqrt(half_x**2 + pad_y**2 + pad_z**2)
        near = KDTree(points).query_ball_point(candidates.positions, reach)
        counts = np.zeros(len(candidates), int)
        for row, (indices, pose) in enumerate(zip(near, candidates.Ts_world_tool, strict=True)):
            local = np.abs((points[indices] - pose[:3, 3]) @ pose[:3, :3])
            counts[row] = np.all(local <= (half_x[row], pad_y, pad_z), axis=1).sum()
        return counts
