"""Free motions between two postures: straight in the joints, over a way point, or searched."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sr_mj.planning.clearance import Clearance
from sr_mj.planning.config import PlannerConfig
from sr_mj.planning.search import search_path
from sr_mj.trajectory import fit_path

# Way points along a path with corners, so that the spline through them hugs it.
_HUG_STEPS_RAD = (0.3, 0.12)
_SLACK_M = 0.002


@dataclass(frozen=True, kw_only=True, eq=False)
class FreePath:
    """A collision-free motion.

    Attributes:
        waypoints: (W, 6) joint angles, rad; the spline of `fit_path` through them is free.
        is_searched: Whether the sampling planner found it.
    """

    waypoints: np.ndarray
    is_searched: bool = False


@dataclass(kw_only=True, eq=False)
class Connector:
    """Finds the free motions of one decision.

    Attributes:
        config: Margins, steps and settings of the search.
        searches_left: How often the sampling planner may still be used: it costs more than all
            the rest of a plan.
    """

    config: PlannerConfig
    searches_left: int

    def connect(
        self,
        start: np.ndarray,
        goal: np.ndarray,
        clearance: Clearance,
        *,
        via: Sequence[np.ndarray] = (),
        may_go_direct: bool = True,
        may_search: bool = True,
    ) -> FreePath | None:
        """Find a free motion.

        It keeps `margin_m` from the cloud, or as much as the nearer of its ends has.

        Args:
            start: (6,) first posture, rad.
            goal: (6,) last posture, rad.
            clearance: Measures postures.
            via: Way points (6,) of which each is tried alone, in this order, if the straight
                motion is not free.
            may_go_direct: Whether the straight motion is tried first.
            may_search: Whether the sampling planner is tried last.

        Returns:
            The motion, or None if none was found.
        """
        config = self.config
        at_ends = float(clearance.measure(np.stack([start, goal])).min())
        if at_ends < config.least_margin_m:
            return None
        test = _MotionTest(
            clearance=clearance,
            margin_m=min(config.margin_m, at_ends - _SLACK_M),
            step_rad=config.check_step_rad,
        )
        if may_go_direct and test.is_edge_free(start, goal):
            return FreePath(waypoints=np.stack([start, goal]))
        for point in via:
            if test.is_edge_free(start, point) and test.is_edge_free(point, goal):
                path = test.hug(np.stack([start, point, goal]))
                if path is not None:
                    return FreePath(waypoints=path)
        return self._search(start, goal, test) if may_search else None

    def _search(self, start: np.ndarray, goal: np.ndarray, test: "_MotionTest") -> FreePath | None:
        if not self.searches_left:
            return None
        self.searches_left -= 1
        corners = search_path(start, goal, test.is_edge_free, self.config.search)
        path = None if corners is None else test.hug(corners)
        return None if path is None else FreePath(waypoints=path, is_searched=True)


@dataclass(frozen=True, kw_only=True, eq=False)
class _MotionTest:
    """Tests motions against a margin at steps of the joints."""

    clearance: Clearance
    margin_m: float
    step_rad: float

    def is_free(self, postures: np.ndarray) -> bool:
        """Test postures (P, 6) of a motion."""
        # A few spread over the motion find most collisions.
        coarse = postures[len(postures) // 8 :: max(len(postures) // 4, 1)]
        parts = (coarse, postures)
        return all(bool((self.clearance.measure(part) >= self.margin_m).all()) for part in parts)

    def is_edge_free(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Test the straight joint motion between two postures (6,)."""
        return self.is_free(_along(start, end, self.step_rad))

    def hug(self, corners: np.ndarray) -> np.ndarray | None:
        """Add way points between corners (W, 6) until the spline through all is free."""
        length = np.abs(np.diff(corners, axis=0)).max(axis=1).sum()
        samples = np.linspace(0, 1, int(np.ceil(length / self.step_rad)) + 1)
        for step in _HUG_STEPS_RAD:
            parts = [_along(a, b, step)[:-1] for a, b in itertools.pairwise(corners)]
            waypoints = np.concatenate([*parts, corners[-1:]])
            if self.is_free(fit_path(waypoints)(samples)):
                return waypoints
        return None


def _along(start: np.ndarray, end: np.ndarray, step: float) -> np.ndarray:
    """Postures (P, 6) on a straight joint motion, both ends included."""
    count = max(int(np.ceil(np.abs(end - start).max() / step)), 1) + 1
    return start + np.linspace(0, 1, count)[:, None] * (end - start)
