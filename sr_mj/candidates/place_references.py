"""The things in a cloud that something can be put on, into or beside, seen from above."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from perception.segments import find_segments
from sr_mj.candidates.place_config import PlaceConfig
from sr_mj.candidates.surface import ObjectSurface

# A part split off at creases is a thing of its own if it is neither most of the whole nor a crumb.
_LEAST_PART_M2, _LARGEST_SHARE = 6e-4, 0.75
# The middle third of the smaller side, as the protocol's rule for "in" and "on" has it.
_CORE_SHARE = 1 / 3
_MIN_POINTS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """A segment of the cloud.

    Attributes:
        outline: Convex polygon in world x, y, metres.
        core: The part of it where the centre of something put on it should be.
        center: (2,) centroid of the outline.
        side_m: Smaller side of the outline.
    """

    outline: BaseGeometry
    core: BaseGeometry
    center: np.ndarray
    side_m: float


def find_references(surface: ObjectSurface, config: PlaceConfig) -> tuple[Reference, ...]:
    """Outline the connected parts of a surface, and the larger parts that creases divide them into.

    Connection joins things that touch, creases split things that have limbs; a place beside either
    is worth a candidate.

    Args:
        surface: Points over the table.
        config: Settings.

    Returns:
        The references, whole parts first.
    """
    wholes = _outlines(surface, config, is_split=False)
    parts = _outlines(surface, config, is_split=True)
    areas = np.array([outline.area for outline in wholes])
    for part in parts:
        around = np.array([outline.intersects(part.centroid) for outline in wholes], bool)
        share = part.area / areas[around].min() if around.any() else 1.0
        if part.area > _LEAST_PART_M2 and share < _LARGEST_SHARE:
            wholes.append(part)
            areas = np.append(areas, np.inf)
    return tuple(_reference(outline) for outline in wholes)


def _outlines(surface: ObjectSurface, config: PlaceConfig, *, is_split: bool) -> list[BaseGeometry]:
    segments = find_segments(
        surface.points, surface.normals, replace(config.segments, is_split_at_creases=is_split)
    )
    hulls = [shapely.MultiPoint(surface.points[s.indices, :2]).convex_hull for s in segments]
    return [hull for hull in hulls if hull.geom_type == "Polygon"]


def _reference(outline: BaseGeometry) -> Reference:
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    side_m = float(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min())
    core = outline.buffer(-side_m * (1 - _CORE_SHARE) / 2)
    center = shapely.get_coordinates(outline.centroid)[0]
    return Reference(outline=outline, core=core, center=center, side_m=side_m)


def core_places(reference: Reference, num: int) -> np.ndarray:
    """Spread places over the core of a reference.

    Args:
        reference: The reference.
        num: How many, about.

    Returns:
        (P, 2) metres; the centre of the reference comes first.
    """
    places = [reference.center[None]]
    if reference.core.area > 0:
        spacing = max((reference.core.area / num) ** 0.5, 1e-3)
        x0, y0, x1, y1 = reference.core.bounds
        steps_x = reference.center[0] + spacing * _steps(x0, x1, reference.center[0], spacing)
        steps_y = reference.center[1] + spacing * _steps(y0, y1, reference.center[1], spacing)
        grid = np.stack(np.meshgrid(steps_x, steps_y), axis=-1).reshape(-1, 2)
        inside = shapely.intersects_xy(reference.core, grid[:, 0], grid[:, 1])
        inside &= (grid != reference.center).any(axis=1)
        places.append(grid[inside])
    return np.concatenate(places)


def _steps(low: float, high: float, center: float, spacing: float) -> np.ndarray:
    first, last = np.ceil((low - center) / spacing), np.floor((high - center) / spacing)
    return np.arange(first, last + 1)


def edge_distances(references: Iterable[Reference], xy: np.ndarray) -> np.ndarray:
    """Measure how far places are from the edges of references.

    Args:
        references: S references.
        xy: (P, 2) metres.

    Returns:
        (S, P) metres; 0 inside.
    """
    points = shapely.points(xy)
    rows = [shapely.distance(reference.outline, points) for reference in references]
    return np.array(rows).reshape(len(rows), len(xy))
