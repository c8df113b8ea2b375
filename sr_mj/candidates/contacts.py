"""Contact patches between the closing fingers, from observed points and normals."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import torch

from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.neighbourhoods import Neighbourhoods, exact_axes
from sr_mj.candidates.strips import OUTWARD, FingerPlacements

# Points this close to the outermost one make a contact patch; a soft pad and the noise of the
# cloud are of this order.
_PATCH_M = 0.005
_EDGE_MARGIN_M = 0.003
_MIN_POINTS = 4
# A flank known only by its outline counts a little less than one that was seen.
_OUTLINE_TRUST = 0.9
_BALANCE_HALF_M = 0.05
_ROWS_A_CHUNK = 128


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
    """

    center_m: np.ndarray
    width_m: np.ndarray
    alignment: np.ndarray
    opposition: np.ndarray
    area: np.ndarray
    offset_m: np.ndarray


class _Between(NamedTuple):
    """Points that the closing fingers may reach, one row a pair of placement and point."""

    row: np.ndarray
    x: np.ndarray
    y: np.ndarray
    height: np.ndarray
    normal: np.ndarray


def find_contacts(
    placements: FingerPlacements,
    around: Neighbourhoods,
    normals: np.ndarray,
    config: AntipodalConfig,
) -> Contacts:
    """Measure the contact patches of finger placements.

    Args:
        placements: H finger placements.
        around: Observed points around the seeds.
        normals: (N, 3) unit normals of the observed points.
        config: The sampler's settings.

    Returns:
        The contacts of the H placements.
    """
    chunks = []
    for start in range(0, max(len(placements.seed), 1), _ROWS_A_CHUNK):
        part = placements.take(slice(start, start + _ROWS_A_CHUNK))
        chunks.append(_measure(part, _points_between(part, around, normals), config))
    return Contacts(
        **{
            field.name: np.concatenate([getattr(chunk, field.name) for chunk in chunks])
            for field in fields(Contacts)
        }
    )


def _points_between(
    placements: FingerPlacements, around: Neighbourhoods, normals: np.ndarray
) -> _Between:
    """Express the points between the fingers in tool axes: x from the middle, height over tips."""
    size = around.count[placements.seed].max(initial=0)
    offsets = torch.from_numpy(around.offsets[placements.seed, :size])
    local = torch.bmm(offsets, exact_axes(placements.rotation))
    x = local[..., 0] - torch.from_numpy(placements.center_m)[:, None]
    reach = torch.from_numpy(placements.width_m / 2 + _EDGE_MARGIN_M)[:, None]
    height = torch.from_numpy(placements.depth_m)[:, None] - local[..., 2]
    inside = (x.abs() < reach) & (height > 0) & (local[..., 1].abs() < _BALANCE_HALF_M)
    row, place = torch.nonzero(inside, as_tuple=True)
    point = around.index[placements.seed[row.numpy()], place.numpy()]
    return _Between(
        row=row.numpy(),
        x=x[row, place].numpy(),
        y=local[row, place, 1].numpy(),
        height=height[row, place].numpy(),
        normal=np.einsum("pi,pij->pj", normals[point], placements.rotation[row.numpy()]),
    )


def _measure(placements: FingerPlacements, between: _Between, config: AntipodalConfig) -> Contacts:
    count = len(placements.seed)
    half_y, half_z = config.gripper.pad_half_m
    is_pinched = (np.abs(between.y) < half_y) & (between.height < 2 * half_z)
    row, x, normal = between.row[is_pinched], between.x[is_pinched], between.normal[is_pinched]
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

    faces = _row_means(row, x, patches, sizes)
    low = np.where(is_seen[:, 0], faces[:, 0], low)
    high = np.where(is_seen[:, 1], faces[:, 1], high)

    total = np.bincount(between.row, minlength=count)
    offset = np.bincount(between.row, between.y, count) / np.maximum(total, 1)
    return Contacts(
        center_m=placements.center_m + (low + high) / 2,
        width_m=high - low,
        alignment=np.where(is_seen, seen, outlined),
        opposition=(flanks[:, 0] * flanks[:, 1]).sum(axis=1),
        area=np.minimum(sizes.min(axis=1) * config.voxel_m**2 / (4 * half_y * half_z), 1.0),
        offset_m=np.abs(offset),
    )


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
