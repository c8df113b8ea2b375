"""Panels, the painted pieces of an object's surface, and the atlas that joins their images."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from models.errors import AssetError
from models.objects.surface import Surface, join, rounded_box

ATLAS_PX = 512
# Texels repeated around every image, so that filtering never mixes in a neighbour.
_GUTTER_PX = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """A piece of surface with its own image.

    Attributes:
        surface: The piece; texture coordinates cover the image.
        image: (H, W, 3) uint8, row 0 at v = 1.
    """

    surface: Surface
    image: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid:
    """A closed body made of panels.

    Attributes:
        panels: Pieces that together close the surface.
    """

    panels: tuple[Panel, ...]

    @classmethod
    def of(cls, surface: Surface, image: np.ndarray) -> "Solid":
        """Wrap one closed surface with one image."""
        return cls(panels=(Panel(surface=surface, image=image),))


def box_solid(
    size: ArrayLike,
    radius_m: float,
    images: np.ndarray | Sequence[np.ndarray],
    center: ArrayLike = (0, 0, 0),
    rotation: Rotation | None = None,
) -> Solid:
    """Make a box with rounded edges.

    Args:
        size: Extents along x, y and z, metres.
        radius_m: Radius of the edges.
        images: One image for all sides, or six in the order of `rounded_box`.
        center: Where its centre goes, metres.
        rotation: Turn about its centre.

    Returns:
        The solid.
    """
    painted = [images] * 6 if isinstance(images, np.ndarray) else images
    sides = zip(rounded_box(size, radius_m), painted, strict=True)
    return Solid(
        panels=tuple(Panel(surface=s.moved(center, rotation), image=image) for s, image in sides)
    )


def _shelve(sizes: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Place rectangles (height, width) on shelves; return the top left corner (row, column)."""
    corners = [(0, 0)] * len(sizes)
    row = column = shelf = 0
    for index in sorted(range(len(sizes)), key=lambda k: (-sizes[k][0], -sizes[k][1], k)):
        height, width = sizes[index]
        if column + width > ATLAS_PX:
            row, column, shelf = row + shelf, 0, 0
        if width > ATLAS_PX or row + height > ATLAS_PX:
            raise AssetError(
                f"Images of {len(sizes)} panels do not fit a {ATLAS_PX} px texture; "
                "paint them smaller."
            )
        corners[index] = (row, column)
        column += width
        shelf = max(shelf, height)
    return corners


def join_panels(panels: list[Panel]) -> tuple[Surface, np.ndarray]:
    """Join panels into one mesh with one texture.

    Args:
        panels: The pieces; images that are the same array share their place.

    Returns:
        The joined surface and its (H, W, 3) uint8 texture.

    Raises:
        AssetError: If the images do not fit.
    """
    images = list({id(panel.image): panel.image for panel in panels}.values())
    index_of = {id(image): index for index, image in enumerate(images)}
    padded = [
        np.pad(image, ((_GUTTER_PX, _GUTTER_PX), (_GUTTER_PX, _GUTTER_PX), (0, 0)), mode="edge")
        for image in images
    ]
    corners = _shelve([image.shape[:2] for image in padded])
    height = max(row + image.shape[0] for (row, _), image in zip(corners, padded, strict=True))
    width = max(col + image.shape[1] for (_, col), image in zip(corners, padded, strict=True))
    texture = np.zeros((height, width, 3), np.uint8)
    for (row, column), image in zip(corners, padded, strict=True):
        texture[row : row + image.shape[0], column : column + image.shape[1]] = image

    placed = []
    for panel in panels:
        row, column = corners[index_of[id(panel.image)]]
        rows, columns = panel.image.shape[:2]
        left = column + _GUTTER_PX + panel.surface.uv[:, 0] * columns
        top = row + _GUTTER_PX + (1 - panel.surface.uv[:, 1]) * rows
        uv = np.stack([left / width, 1 - top / height], axis=1)
        placed.append(replace(panel.surface, uv=uv))
    return join(placed), texture
