"""Contact patches between the closing fingers, from observed points and normals."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sr_mj.candidates.columns import points_in_boxes, sort_into_columns
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.strips import OUTWARD, FingerPlacements
from sr_mj.candidates.surface import ObjectSurface, thin

# Points this close to the outermost one make a contact patch; a soft pad and the noise of the
# cloud are of this order.
_PATCH_M = 0.005
_EDGE_MARGIN_M = 0.003
_MIN_POINTS = 4
# A flank known only by its outline counts a little less than one that was seen.
_OUTLINE_TRUST = 0.9
# The balance of what is between the fingers is that of coarser points, further to their sides.
_BALANCE_HALF_M, _BALANCE_HEIGHT_M, _BALANCE_VOXEL_M = 0.05, 0.06, 0.008
_COLUMN_M = 0.01
# Between the contacts, heights are compared in steps of a voxel; the stroke has 22 of them.
_STEP_M, _NUM_STEPS = 0.004, 24


@dataclass(frozen=True, kw_only=True)
class Contacts:
    """What the fingers would touch. All arrays have H rows.

    Attributes:
        center_m: Middle between the contacts along the closing direction, from the seed.
        width_m: Distance between the contacts.
        alignment: (H, 2) mean cosine of the contact normals and the outward closing direction.
        opposition: Cosine between the mean normals of both patches; -1 is antipodal.
        area: 0..1, the smaller patch's share of a pad.
        offset_m: Distance of the object's local centre from the fingers, along the pads' width.
        gap: 0..1, how far what is seen between the contacts falls off towards the fingertips
            before it rises again, as a share of the lower side's height over them.
        contrast: Distance of the two patches' colours, each as shares of red, green and blue.
    """

    center_m: np.ndarray
    width_m: np.ndarray
    alignment: np.ndarray
    opposition: np.ndarray
    area: np.ndarray
    offset_m: np.ndarray
    gap: np.ndarray
    contrast: np.ndarray


class _Between(NamedTuple):
    """Points between fingers: placement, point, and tool coordinates from the seed, (P,) each."""

    row: np.ndarray
    point: np.ndarray
    local: list[np.ndarray]


def find_contacts(
    placements: FingerPlacements,
    origins: np.ndarray,
    surface: ObjectSurface,
    config: AntipodalConfig,
) -> Contacts:
    """Measure the contact patches of finger placements.

    Args:
        placements: H finger placements.
        origins: (S, 3) positions of the seeds.
        surface: Observed points and normals.
        config: The sampler's settings.

    Returns:
        The contacts of the H placements.
    """
    count = len(placements.seed)
    poses = np.zeros((count, 4, 4))
    poses[:, :3, :3], poses[:, :3, 3] = placements.rotation, origins[placements.seed]
    half_y, half_z = config.gripper.pad_half_m
    reach = half_y, 2 * half_z
    row, point, (x, z) = _points_between(placements, poses, surface.points, reach, (0, 2))
    x -= placements.center_m[row]
    normal = np.einsum("pi,pij->pj", surface.normals[point], placements.rotation[row])

    low, high = _extent(row, x, placements.width_m)
    patches = (x < low[row] + _PATCH_M, x > high[row] - _PATCH_M)
    sizes = np.stack([np.bincount(row[patch], minlength=count) for patch in patches], axis=1)
    mean = np.stack([_row_means(row, axis, patches, sizes) for axis in normal.T], axis=-1)
    seen, outlined = mean[..., 0] * OUTWARD, _OUTLINE_TRUST * placements.alignment
    # Points of a side that no camera faces lie on its edge, and their normals tell nothing. Of a
    # side that was seen, the mean is its place: the outermost points stand out by their noise.
    is_seen = (seen > outlined) & (sizes >= _MIN_POINTS)
    flanks = np.where(is_seen[..., None], mean, placements.outline)
    flanks /= np.maximum(np.linalg.norm(flanks, axis=-1, keepdims=True), 1e-6)

    gap = _valley(row, x - low[row], placements.depth_m[row] - z, count)
    red, green = (_row_means(row, part[point], patches, sizes) for part in _shares(surface.colors))
    red, green = red[:, 0] - red[:, 1], green[:, 0] - green[:, 1]
    # Shares add up to one, hence their differences to zero.
    contrast = np.abs(red) + np.abs(green) + np.abs(red + green)

    faces = _row_means(row, x, patches, sizes)
    low = np.where(is_seen[:, 0], faces[:, 0], low)
    high = np.where(is_seen[:, 1], faces[:, 1], high)
    return Contacts(
        center_m=placements.center_m + (low + high) / 2,
        width_m=high - low,
        alignment=np.where(is_seen, seen, outlined),
        opposition=(flanks[:, 0] * flanks[:, 1]).sum(axis=1),
        area=np.minimum(sizes.min(axis=1) * config.voxel_m**2 / (4 * half_y * half_z), 1.0),
        offset_m=_imbalance(placements, poses, surface.points),
        gap=gap,
        contrast=np.where(sizes.min(axis=1) > 0, contrast, 0.0),
    )


def _points_between(
    placements: FingerPlacements,
    poses: np.ndarray,
    points: np.ndarray,
    reach_m: tuple[float, float],
    axes: tuple[int, ...],
) -> _Between:
    """Find the points between the fingers, `reach_m` to either side and above the fingertips.

    Their coordinates are given along some of the tool's axes.
    """
    half_x = placements.width_m / 2 + _EDGE_MARGIN_M
    half_y = np.full_like(half_x, reach_m[0])
    low = [placements.center_m - half_x, -half_y, placements.depth_m - reach_m[1]]
    high = [placements.center_m + half_x, half_y, placements.depth_m]
    low, high = np.stack(low, axis=1), np.stack(high, axis=1)
    columns = sort_into_columns(points, _COLUMN_M)
    row, point = points_in_boxes(points, columns, poses, low, high)
    x, y, z = (points[:, axis][point] - poses[:, axis, 3][row] for axis in range(3))
    local = [
        x * poses[:, 0, axis][row] + y * poses[:, 1, axis][row] + z * poses[:, 2, axis][row]
        for axis in axes
    ]
    return _Between(row=row, point=point, local=local)


def _imbalance(placements: FingerPlacements, poses: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance (H,) of the fingers from the middle of what is between them, along the pads."""
    coarse = thin(points, _BALANCE_VOXEL_M)
    reach = _BALANCE_HALF_M, _BALANCE_HEIGHT_M
    row, _, (y,) = _points_between(placements, poses, coarse, reach, (1,))
    total = np.bincount(row, minlength=len(poses))
    offset = np.bincount(row, y, len(poses))
    return np.abs(offset / np.maximum(total, 1))


def _shares(colors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of red and of green in colours (N, 3), which shade and light leave as they are."""
    total = np.maximum(colors.sum(axis=1), 1e-3)
    return colors[:, 0] / total, colors[:, 1] / total


def _valley(row: np.ndarray, x: np.ndarray, height_m: np.ndarray, count: int) -> np.ndarray:
    """Deepest valley of every row as a share of its lower brink, from points (P,); (count,)."""
    step = np.minimum((x * (1 / _STEP_M)).astype(np.int64), _NUM_STEPS - 1)
    top = np.zeros((count, _NUM_STEPS), np.float32)
    np.maximum.at(top.reshape(-1), row * _NUM_STEPS + step, height_m.astype(np.float32))
    left = np.maximum.accumulate(top, axis=1)
    right = np.maximum.accumulate(top[:, ::-1], axis=1)[:, ::-1]
    brink = np.minimum(left, right)
    return ((brink - top) / np.maximum(brink, 1e-3)).max(axis=1)


def _extent(row: np.ndarray, x: np.ndarray, width_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outermost points of every row; those of the placement where nothing was observed."""
    low, high = np.full(len(width_m), np.inf), np.full(len(width_m), -np.inf)
    np.minimum.at(low, row, x)
    np.maximum.at(high, row, x)
    is_empty = np.isinf(low)
    return np.where(is_empty, -width_m / 2, low), np.where(is_empty, width_m / 2, high)


def _row_means(
    row: np.ndarray, values: np.ndarray, patches: tuple[np.ndarray, ...], sizes: np.ndarray
) -> np.ndarray:
    """Average (P,) values over the rows' left and right patches, (H, 2); 0 for empty patches."""
    sums = [np.bincount(row[patch], values[patch], len(sizes)) for patch in patches]
    return np.stack(sums, axis=1) / np.maximum(sizes, 1)
