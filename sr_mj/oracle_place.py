"""How well a place would satisfy a goal, by ground truth; for the oracle only."""

import numpy as np
import shapely
from scipy.spatial import ConvexHull
from shapely.geometry.base import BaseGeometry

from models.robot import TOOL_SITE_NAME
from policy.actions import ActionCandidates
from sr_mj.scene import Scene
from sr_mj.scene.placement import RING_M, find_object, footprint, place_region

_ENOUGH_M = 0.02
"""A margin beyond this is as good as any more."""
_LEAST_M = 0.006
"""Margin that what is let go of may use up: it settles by a few millimetres."""
_IN_REGION = 10.0


def score_places(scene: Scene, moved: str, candidates: ActionCandidates) -> np.ndarray:
    """Score places by how far inside a valid region the object would come to lie.

    Args:
        scene: The scene, with the object in the gripper.
        moved: Name of that object.
        candidates: K places.

    Returns:
        (K,): 10 + margin (0..1) + prior / 2 for places inside a region, otherwise
        prior / 2 - distance from the nearest one in decimetres.
    """
    prior = candidates.prior / 2
    place = scene.goal.place
    if place is None or not place.references or not len(candidates):
        return prior
    outlines, centers = _predicted(scene, moved, candidates)
    scores = []
    for reference in place.references:
        region = place_region(scene, place.relation, reference, moved=moved)
        others = [o.name for o in scene.objects if o.name not in (reference, moved)]
        obstacles = shapely.union_all([footprint(scene, name) for name in others])
        if region.is_inside:
            margin = _depth(region.area, centers)
            margin = np.where(margin > 0, margin + _ENOUGH_M / 2, margin)
            blocked = shapely.distance(outlines, obstacles) < _LEAST_M
        else:
            margin = _ring_margin(scene, footprint(scene, reference), centers)
            gap = shapely.distance(outlines, obstacles.union(footprint(scene, reference)))
            margin = np.minimum(margin, gap)
            blocked = gap < _LEAST_M
        good = (margin > 0) & ~blocked
        gain = _IN_REGION + np.clip(margin / _ENOUGH_M, 0, 1)
        scores.append(np.where(good, gain, np.minimum(10 * margin, 0) - blocked))
    return prior + np.max(scores, axis=0)


def _predicted(
    scene: Scene, moved: str, candidates: ActionCandidates
) -> tuple[np.ndarray, np.ndarray]:
    """Predict outlines (K,) and centres of mass (K, 2), from above, when the gripper opens."""
    item, tool = find_object(scene, moved), scene.data.site(TOOL_SITE_NAME)
    pose = scene.T_world_object(moved)
    # An outline from above, in whatever pose, is that of the hull.
    hull = item.asset.vertices[ConvexHull(item.asset.vertices).vertices]
    vertices = hull @ pose[:3, :3].T + pose[:3, 3]
    points = np.concatenate([scene.data.xipos[item.body.body_id][None], vertices])
    in_tool = (points - tool.xpos) @ tool.xmat.reshape(3, 3)
    rotations, origins = candidates.Ts_world_tool[:, :2, :3], candidates.positions[:, :2]
    placed = np.einsum("kij,pj->kpi", rotations, in_tool) + origins[:, None]
    outlines = shapely.convex_hull(
        shapely.multipoints(
            placed[:, 1:].reshape(-1, 2),
            indices=np.repeat(np.arange(len(candidates)), len(vertices)),
        )
    )
    return np.asarray(outlines), placed[:, 0]


def _depth(area: BaseGeometry, centers: np.ndarray) -> np.ndarray:
    """Return how far inside an area points (K, 2) lie; negative outside."""
    points = shapely.points(centers)
    inside = shapely.intersects_xy(area, centers[:, 0], centers[:, 1])
    return np.where(
        inside, shapely.distance(area.boundary, points), -shapely.distance(area, points)
    )


def _ring_margin(scene: Scene, outline: BaseGeometry, centers: np.ndarray) -> np.ndarray:
    """Return how far from the ring's and the workspace's edges points (K, 2) lie."""
    distance = shapely.distance(outline, shapely.points(centers))
    lower, upper = np.array(scene.workspace.lower[:2]), np.array(scene.workspace.upper[:2])
    edges = np.minimum(centers - lower, upper - centers).min(axis=1)
    return np.minimum(np.minimum(distance - RING_M[0], RING_M[1] - distance), edges)
