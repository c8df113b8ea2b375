"""Joint paths around obstacles: RRT-Connect with shortcuts.

J. Kuffner and S. LaValle, "RRT-Connect: An Efficient Approach to Single-Query Path Planning" (ICRA
2000, https://doi.org/10.1109/ROBOT.2000.844730).
"""

from collections.abc import Callable

import numpy as np

from sr_mj.closed_form import JOINT_LIMITS
from sr_mj.planning.config import SearchConfig

EdgeTest = Callable[[np.ndarray, np.ndarray], bool]
"""Tells whether the straight joint motion between two postures (6,) is free."""


class _Tree:
    """Postures with the index of the one that each was reached from."""

    def __init__(self, root: np.ndarray) -> None:
        self.nodes = [root]
        self.parents = [-1]

    def nearest(self, posture: np.ndarray) -> int:
        gaps = np.abs(np.array(self.nodes) - posture).max(axis=1)
        return int(gaps.argmin())

    def add(self, posture: np.ndarray, parent: int) -> int:
        self.nodes.append(posture)
        self.parents.append(parent)
        return len(self.nodes) - 1

    def branch(self, index: int) -> list[np.ndarray]:
        """Postures from the root to a node."""
        nodes = []
        while index >= 0:
            nodes.append(self.nodes[index])
            index = self.parents[index]
        return nodes[::-1]


def search_path(
    start: np.ndarray, goal: np.ndarray, is_free: EdgeTest, config: SearchConfig
) -> np.ndarray | None:
    """Find a free joint path.

    Args:
        start: (6,) first posture, rad; free.
        goal: (6,) last posture, rad; free.
        is_free: Tests straight joint motions.
        config: Number and spread of samples; its seed makes the same question get the same path.

    Returns:
        (W, 6) waypoints between which straight joint motions are free, or None if none was found.
    """
    rng = np.random.default_rng(config.seed)
    low = np.maximum(np.minimum(start, goal) - config.reach_rad, -JOINT_LIMITS)
    high = np.minimum(np.maximum(start, goal) + config.reach_rad, JOINT_LIMITS)
    trees = [_Tree(start), _Tree(goal)]
    for sample in rng.uniform(low, high, (config.max_samples, 6)):
        grown, reached = _grow(trees[0], sample, is_free, config.step_rad)
        if reached is not None:
            other, met = _connect(trees[1], reached, is_free, config.step_rad)
            if met:
                first, second = trees[0].branch(grown), trees[1].branch(other)
                if trees[0].nodes[0] is not start:
                    first, second = second, first
                return shorten(np.array(first + second[::-1][1:]), is_free, config, rng)
        trees.reverse()
    return None


def shorten(
    path: np.ndarray, is_free: EdgeTest, config: SearchConfig, rng: np.random.Generator
) -> np.ndarray:
    """Cut a path short between random points of it, where the way between them is free.

    Args:
        path: (W, 6) waypoints.
        is_free: Tests straight joint motions.
        config: Number of attempts.
        rng: Draws the points.

    Returns:
        (V, 6) waypoints of a path that is no longer.
    """
    for _ in range(config.num_shortcuts):
        if len(path) < 3:
            break
        lengths = np.abs(np.diff(path, axis=0)).max(axis=1)
        ends = np.sort(rng.uniform(0, lengths.sum(), 2))
        (i, a), (j, b) = (_point_at(path, lengths, end) for end in ends)
        if i < j and is_free(a, b):
            path = np.concatenate([path[: i + 1], [a, b], path[j + 1 :]])
    return path


def _point_at(path: np.ndarray, lengths: np.ndarray, at: float) -> tuple[int, np.ndarray]:
    """Segment and posture at a distance along a path."""
    ends = np.cumsum(lengths)
    i = min(int(np.searchsorted(ends, at)), len(lengths) - 1)
    u = 1 - (ends[i] - at) / max(lengths[i], 1e-12)
    return i, path[i] + np.clip(u, 0, 1) * (path[i + 1] - path[i])


def _grow(
    tree: _Tree, towards: np.ndarray, is_free: EdgeTest, step: float
) -> tuple[int, np.ndarray | None]:
    """Grow a tree by one step; index and posture of the new node, or None if blocked."""
    near = tree.nearest(towards)
    gap = towards - tree.nodes[near]
    posture = tree.nodes[near] + gap * min(1.0, step / max(np.abs(gap).max(), 1e-12))
    if not is_free(tree.nodes[near], posture):
        return near, None
    return tree.add(posture, near), posture


def _connect(tree: _Tree, goal: np.ndarray, is_free: EdgeTest, step: float) -> tuple[int, bool]:
    """Grow a tree step by step to a posture; index of the last node, and whether it got there."""
    while True:
        index, reached = _grow(tree, goal, is_free, step)
        if reached is None:
            return index, False
        if np.abs(reached - goal).max() < 1e-9:
            return index, True
