"""How a held object fits at places: what carries it, how high it is let go, what is in the way."""

from dataclasses import dataclass, fields

import numpy as np

from sr_mj.candidates.place_columns import Columns
from sr_mj.candidates.place_config import PlaceConfig
from sr_mj.candidates.place_heights import HeightMap

_DIRECTIONS = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], axis=0)
_RAY_STEP_M, _RAY_STEPS = 0.008, 16
# Places times columns looked up at once; bounds the memory.
_LOOKUPS_A_CHUNK = 400_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Hypotheses of P places times Y turns, one a row; H rows that passed every check.

    Attributes:
        place: (H,) index of the place.
        yaw: (H,) index of the turn.
        tool: (H, 3) position of the tool at the release, metres.
        fall_m: (H,) how far the object falls when it is let go.
        clearance_m: (H,) distance of its outline from everything else on the table.
        balance_m: (H,) how far its centre lies inside what carries it.
        contact: (H,) share of its outline that is carried.
    """

    place: np.ndarray
    yaw: np.ndarray
    tool: np.ndarray
    fall_m: np.ndarray
    clearance_m: np.ndarray
    balance_m: np.ndarray
    contact: np.ndarray

    def take(self, rows: np.ndarray) -> "Fits":
        """Select rows by index or mask."""
        return Fits(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def __len__(self) -> int:
        """Return H."""
        return len(self.place)


@dataclass(frozen=True, kw_only=True, eq=False)
class Load:
    """What the tool carries down.

    Attributes:
        held: Columns of the held object.
        gripper: Columns of the gripper, opened.
        low_m: Height of the object's lowest point over the tool's origin; negative.
    """

    held: Columns
    gripper: Columns
    low_m: float


def fit_on_table(
    places: np.ndarray, load: Load, heights: HeightMap, bounds: np.ndarray, config: PlaceConfig
) -> Fits:
    """Find the places on the free table where an object can stand.

    Args:
        places: (P, 2) where its centre would be, metres.
        load: The object and the gripper.
        heights: The scene.
        bounds: (2, 2) lower and upper corner of the workspace, x, y.
        config: Settings.

    Returns:
        The fits.
    """
    parts = []
    for index, yaw in enumerate(config.yaws):
        outline = load.held.turned(yaw) - _turned_center(load, yaw)
        inside = places + outline.min(axis=0) > bounds[0] + config.edge_m
        inside &= places + outline.max(axis=0) < bounds[1] - config.edge_m
        rows = np.flatnonzero(inside.all(axis=1))
        clearance = _over_columns(heights.clearance_m, places[rows], outline).min(axis=1)
        is_free = clearance > config.clearance_m
        rows, clearance = rows[is_free], clearance[is_free]
        center = _turned_center(load, yaw)
        wanted = -load.low_m + config.release_gap_m
        lift = (_gripper_height(places[rows] - center, yaw, load, heights, config) - wanted).clip(0)
        good = lift <= config.max_lift_m
        rows, lift, clearance = rows[good], lift[good], clearance[good]
        full = np.ones(len(rows))
        parts.append(
            Fits(
                place=rows,
                yaw=np.full(len(rows), index),
                tool=np.column_stack([places[rows] - center, wanted + lift]),
                fall_m=lift + config.release_gap_m,
                clearance_m=clearance,
                balance_m=full * 0.02,
                contact=full,
            )
        )
    return _concatenate(parts)


def fit_on_things(places: np.ndarray, load: Load, heights: HeightMap, config: PlaceConfig) -> Fits:
    """Find the places on and in things where an object would stay.

    It stays where its centre lies inside what carries it, or in a hollow with a rim all around.

    Args:
        places: (P, 2) where its centre would be, metres.
        load: The object and the gripper.
        heights: The scene.
        config: Settings.

    Returns:
        The fits.
    """
    basin = basin_depths(places, heights)
    is_hollow = basin > config.min_basin_m
    parts = []
    for index, yaw in enumerate(config.yaws):
        center = _turned_center(load, yaw)
        outline = load.held.turned(yaw) - center
        under = _over_columns(heights.height_m, places, outline) - (load.held.bottom_m - load.low_m)
        # The floor of a thin vessel is too low to be told from the table around it.
        floor_m = np.where(is_hollow, config.grasping.object_min_height_m, 0)
        support = np.maximum(under.max(axis=1), floor_m)
        carried = under > (support - config.contact_m)[:, None]
        balance = _balance(carried, outline)
        wanted = support - load.low_m + config.release_gap_m
        lift = (_gripper_height(places - center, yaw, load, heights, config) - wanted).clip(0)
        is_on_something = support > config.grasping.object_min_height_m
        good = is_hollow | ((balance > config.min_balance_m) & is_on_something)
        good &= lift <= config.max_fall_m
        rows = np.flatnonzero(good)
        parts.append(
            Fits(
                place=rows,
                yaw=np.full(len(rows), index),
                tool=np.column_stack([places - center, wanted + lift])[rows],
                fall_m=lift[rows] + config.release_gap_m,
                clearance_m=np.zeros(len(rows)),
                balance_m=np.maximum(balance, basin.clip(0, 0.02))[rows],
                contact=carried.mean(axis=1)[rows],
            )
        )
    return _concatenate(parts)


def basin_depths(places: np.ndarray, heights: HeightMap) -> np.ndarray:
    """Measure how deep below its surroundings the ground at places lies.

    Args:
        places: (P, 2) metres.
        heights: The scene.

    Returns:
        (P,) height of the lowest pass on the way out, over the eight directions, metres.
    """
    reach = np.arange(1, _RAY_STEPS + 1) * _RAY_STEP_M
    rays = (_DIRECTIONS.T[:, None] * reach[:, None]).reshape(-1, 2)
    along = _over_columns(heights.height_m, places, rays)
    passes = along.reshape(len(places), 8, _RAY_STEPS).max(axis=2).min(axis=1)
    return passes - heights.height_m(places)


def _turned_center(load: Load, yaw: float) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin], [sin, cos]]) @ load.held.center


def _over_columns(lookup, places: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Look up (P, C) values at every place shifted by every offset (C, 2)."""
    found = np.empty((len(places), len(offsets)), np.float32)
    step = max(_LOOKUPS_A_CHUNK // max(len(offsets), 1), 1)
    for start in range(0, len(places), step):
        part = slice(start, start + step)
        found[part] = lookup(places[part, None] + offsets)
    return found


def _gripper_height(
    tool_xy: np.ndarray, yaw: float, load: Load, heights: HeightMap, config: PlaceConfig
) -> np.ndarray:
    """Least heights (P,) of the tool at which nothing of the gripper touches anything."""
    columns = load.gripper
    under = _over_columns(heights.height_m, tool_xy, columns.turned(yaw)) - columns.bottom_m
    return under.max(axis=1) + config.gripper_clearance_m


def _balance(carried: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """How far the origin lies inside what of an outline (C, 2) is carried (P, C), per place."""
    along = (outline @ _DIRECTIONS).astype(np.float32)
    farthest = [np.where(carried, column, -1.0).max(axis=1) for column in along.T]
    return np.min(farthest, axis=0)


def _concatenate(parts: list[Fits]) -> Fits:
    names = [field.name for field in fields(Fits)]
    return Fits(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})
