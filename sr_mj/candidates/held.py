"""What the gripper holds, as far as it was seen before the grasp."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from perception.cloud import GeometryCloud
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.place_parts import Parts, find_parts
from sr_mj.candidates.removed import removed_points, revealed_heights
from sr_mj.candidates.surface import extract_surface, thin, unseen_walls
from sr_mj.errors import ConfigError

# How far beyond the pads' space a point may lie: the noise of a thinned cloud.
_SLACK_M = 0.003
_SHARE_BETWEEN, _SHARE_OF_PART, _LEAST_ODDS = 0.15, 0.5, 0.5
# An object seen down to this height stood on the table: the cloud without its table loses the
# lowest 5 mm, and the sides below a bulge are not seen.
_LOW_SHARE, _NEAR_TABLE_M, _AROUND_M = 0.02, 0.03, 0.012
_STEP_M, _MIN_SIDES = 0.008, 7
# An object stands on the lowest of what is found below it but for this share, which may be noise or
# seen past its edge: what is found higher it leaned on, or that has slid into its place.
_SUPPORT_SHARE = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class HeldObject:
    """The object in the gripper.

    Attributes:
        points_tool: (N, 3) float32 surface points in the tool frame at the grasp, metres. The
            sides that no camera saw are closed straight down to what the object stood on.
        drop_m: How far the object's lowest point was below the tool's origin at the grasp, along
            the world's vertical, metres.
        T_world_tool: (4, 4) pose of the tool at the grasp.
        width_m: Opening of the gripper around the object, metres.

    Raises:
        ConfigError: If an array has a wrong shape, or a value isn't finite.
    """

    points_tool: np.ndarray
    drop_m: float
    T_world_tool: np.ndarray
    width_m: float

    def __post_init__(self) -> None:
        """Check the arrays and replace them by read-only copies."""
        points = np.array(self.points_tool, np.float32)
        pose = np.array(self.T_world_tool, float)
        if points.ndim != 2 or points.shape[1] != 3 or not len(points):
            raise ConfigError(
                f"HeldObject: points_tool has shape {points.shape}, expected (N, 3) with N > 0."
            )
        if pose.shape != (4, 4):
            raise ConfigError(f"HeldObject: T_world_tool has shape {pose.shape}, expected (4, 4).")
        if not all(np.isfinite(x).all() for x in (points, pose, self.drop_m, self.width_m)):
            raise ConfigError("HeldObject: a value isn't finite.")
        for name, array in (("points_tool", points), ("T_world_tool", pose)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def held_object(
    cloud: GeometryCloud,
    T_world_tool: np.ndarray,
    width_m: float,
    *,
    after: GeometryCloud | None = None,
) -> HeldObject:
    """Cut out of a cloud what a grasp closed on.

    With a second look, what is gone is held, and what lies below it now is what it stood on.
    Without one, or where most between the fingers still seems to be there, what lies between them
    says which parts of the cloud are meant; what is likely of one thing with them belongs to it as
    well. Nothing here is ground truth.

    Args:
        cloud: What was seen before the grasp, in world coordinates, the table at z = 0.
        T_world_tool: (4, 4) pose of the tool at the grasp.
        width_m: Opening at which the fingers came to rest.
        after: What was seen after the grasp, the held object and the robot left out; None if
            nobody looked.

    Returns:
        The object. If nothing was seen between the fingers, the space between them stands for it.
    """
    pose = np.asarray(T_world_tool, float)
    config = AntipodalConfig()
    parts = find_parts(cloud, config)
    points = parts.surface.points
    gripped = _is_between_fingers(points, pose, width_m, config)
    removed = None if after is None else _removed(parts, after, gripped, config)
    if removed is not None:
        seen, bottom_m = removed
    elif gripped.any():
        mine = _belongs(parts, gripped)
        bottom_m = support_height(points, mine)
        seen = points[mine]
    else:
        seen = _space_between_fingers(pose, width_m, config)
        bottom_m = max(float(seen[:, 2].min()), 0.0)
    body = _closed(seen, bottom_m, config)
    local = (body - pose[:3, 3]) @ pose[:3, :3]
    return HeldObject(
        points_tool=local,
        drop_m=float(pose[2, 3] - bottom_m),
        T_world_tool=pose,
        width_m=float(width_m),
    )


def _removed(
    parts: Parts, after: GeometryCloud, gripped: np.ndarray, config: AntipodalConfig
) -> tuple[np.ndarray, float] | None:
    """Return the points (P, 3) that a grasp took away, and the height of what they stood on."""
    if not gripped.any():
        return None
    left = extract_surface(after.points, after.normals, config).points
    mine = removed_points(parts, left, gripped, _belongs(parts, gripped))
    if mine is None:
        return None
    seen = parts.surface.points[mine]
    heights = revealed_heights(seen, after.points)
    lowest = float(np.quantile(seen[:, 2], _LOW_SHARE))
    if lowest < _NEAR_TABLE_M or not len(heights):
        return seen, 0.0
    support = float(np.quantile(heights, _SUPPORT_SHARE))
    return seen, min(support, lowest) if support > config.object_min_height_m else 0.0


def _is_between_fingers(
    points: np.ndarray, pose: np.ndarray, width_m: float, config: AntipodalConfig
) -> np.ndarray:
    """Mask of the points (N, 3) in the space that the pads enclose."""
    gripper = config.gripper
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    inside = np.abs(local[:, 0]) < width_m / 2 + _SLACK_M
    inside &= np.abs(local[:, 1]) < gripper.pad_half_m[0] + _SLACK_M
    inside &= local[:, 2] > -gripper.palm_above_tool_m
    return inside & (local[:, 2] < gripper.tip_below_tool_m + _SLACK_M)


def _space_between_fingers(pose: np.ndarray, width_m: float, config: AntipodalConfig) -> np.ndarray:
    """Points (P, 3) of the box between the pads."""
    y, z = config.gripper.pad_half_m
    x = max(width_m / 2, config.voxel_m)
    axes = [np.linspace(-half, half, int(2 * half / config.voxel_m) + 2) for half in (x, y, z)]
    box = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    return (box @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)


def _belongs(parts: Parts, gripped: np.ndarray) -> np.ndarray:
    """Mask of the points that are of one thing with what the fingers hold."""
    total = np.bincount(parts.labels)
    between = np.bincount(parts.labels[gripped], minlength=len(total))
    # Neighbours that the closing region only grazes are not meant.
    held = (between >= _SHARE_BETWEEN * gripped.sum()) | (between > _SHARE_OF_PART * total)
    # Only what touches them directly: chains of likely joints run through whole heaps.
    mine = held | (parts.joined[held] > _LEAST_ODDS).any(axis=0)
    return mine[parts.labels] | gripped


def support_height(points: np.ndarray, mine: np.ndarray) -> float:
    """Estimate the height of what an object stood on: the table, unless it was seen to be lower.

    Nine of ten objects of a heap reach down to the table somewhere, whatever they lean on. Only
    an object around which, on most sides, something else is seen right below its lowest visible
    points stands on that: too low an estimate lets it fall a little, too high a one presses it
    into what it is put on.

    Args:
        points: (N, 3) points of the cloud, metres, the table at z = 0.
        mine: (N,) which of them are the object's.

    Returns:
        The height, metres.
    """
    own, others = points[mine], points[~mine]
    lowest = float(np.quantile(own[:, 2], _LOW_SHARE))
    if lowest < _NEAR_TABLE_M or not len(others):
        return 0.0
    distance, _ = KDTree(own[:, :2]).query(others[:, :2], distance_upper_bound=_AROUND_M)
    below = np.isfinite(distance) & (np.abs(others[:, 2] - lowest + _STEP_M / 2) < _STEP_M / 2)
    around = others[below, :2] - own[:, :2].mean(axis=0)
    sides = np.unique(np.floor(np.arctan2(around[:, 1], around[:, 0]) * (4 / np.pi)))
    if len(sides) < _MIN_SIDES:
        return 0.0
    return float(np.median(others[below, 2]))


def _closed(seen: np.ndarray, bottom_m: float, config: AntipodalConfig) -> np.ndarray:
    """Close an object's surface down to its support: walls below its edges, and a floor."""
    lifted = seen - np.array([0, 0, bottom_m], np.float32)
    lifted[:, 2] = lifted[:, 2].clip(0)
    walls = unseen_walls(lifted, config.wall_step_m)
    floor = thin(lifted * np.array([1, 1, 0], np.float32), config.voxel_m)
    return np.concatenate([lifted, walls, floor]) + np.array([0, 0, bottom_m], np.float32)
