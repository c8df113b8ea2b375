"""Remembers grasps that failed, so that the next attempt tries something else."""

import numpy as np

from policy.actions import ActionCandidates
from sr_mj.outcome import Outcome

_NEAR_M = 0.015
_NEAR_RAD = np.radians(30)


class FailedGrasps:
    """The poses at which grasps have failed since the scene last changed by a grasp.

    Everything here is known to a real robot: it feels whether its fingers hold something.
    """

    def __init__(self) -> None:
        """Start with an empty memory."""
        self._poses: list[np.ndarray] = []

    def record(self, T_world_tool: np.ndarray | None, outcome: Outcome) -> None:
        """Remember a failed grasp; forget all once something was carried away.

        Args:
            T_world_tool: (4, 4) pose that was chosen, without any error of its execution; None if
                nothing was executed.
            outcome: What came of it.
        """
        if outcome.felt_to_end:
            self._poses.clear()
        elif T_world_tool is not None:
            self._poses.append(T_world_tool)

    def without(self, candidates: ActionCandidates) -> ActionCandidates:
        """Leave out candidates that repeat a failed grasp, unless no others would remain.

        Two grasps are the same if their positions lie within 15 mm and their approach and
        closing directions within 30 degrees, a half turn of the gripper not counted.

        Args:
            candidates: K grasps.

        Returns:
            Those worth trying.
        """
        if not self._poses or not len(candidates):
            return candidates
        failed = np.array(self._poses)
        gap = np.linalg.norm(candidates.positions[:, None] - failed[None, :, :3, 3], axis=-1)
        axes = np.einsum("kij,fij->kfj", candidates.Ts_world_tool[:, :3, :3], failed[:, :3, :3])
        alike = (np.abs(axes[..., 0]) > np.cos(_NEAR_RAD)) & (axes[..., 2] > np.cos(_NEAR_RAD))
        fresh = ~np.any((gap < _NEAR_M) & alike, axis=1)
        return candidates.take(np.flatnonzero(fresh)) if fresh.any() else candidates
