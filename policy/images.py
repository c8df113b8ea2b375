"""The pictures behind a cloud, for the policies that compare the instruction with images."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from policy.arrays import checked_array
from policy.errors import InvalidArrayError


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureFrame:
    """Where the world appears in one picture.

    Attributes:
        P_pixel_world: (3, 4) float64 projection matrix of the camera, K [R | t]: maps a point of
            the world (x, y, z, 1), metres, to d (u, v, 1) with the depth d, metres. Pixel centres
            lie at integers. Copied, checked and made read-only.
        width: Width of the picture, pixels.
        height: Height of the picture, pixels.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value.
    """

    P_pixel_world: np.ndarray
    width: int
    height: int

    def __post_init__(self) -> None:
        """Check the fields."""
        projection = checked_array(
            "P_pixel_world", self.P_pixel_world, (3, 4), dtype=np.float64, sizes={}
        )
        object.__setattr__(self, "P_pixel_world", projection)
        for name in ("width", "height"):
            if not getattr(self, name) > 0:
                raise InvalidArrayError(f"{name}: got {getattr(self, name)}, expected above 0.")

    def parts_of(
        self, positions: Float[np.ndarray, "K 3"], num_parts: int
    ) -> Int[np.ndarray, " K"]:
        """Tell in which part of the picture positions appear; what hides them is not asked.

        Args:
            positions: (K, 3) world coordinates, metres.
            num_parts: G, parts along each side.

        Returns:
            (K,) numbers of parts: row times G plus column, from the top left; -1 for positions
            outside the picture or behind the camera.
        """
        in_camera = positions @ self.P_pixel_world[:, :3].T + self.P_pixel_world[:, 3]
        depth = in_camera[:, 2:]
        pixels = in_camera[:, :2] / np.where(depth > 0, depth, np.nan)
        # The picture reaches from half a pixel before its first centre to half behind its last.
        column, row = np.floor((pixels + 0.5) / (self.width, self.height) * num_parts).T
        is_inside = (column >= 0) & (column < num_parts) & (row >= 0) & (row < num_parts)
        return np.where(is_inside, row * num_parts + column, -1).astype(np.int64)


@runtime_checkable
class ImageSource(Protocol):
    """Describes the pictures that an observation was made from.

    Nothing is computed before it is asked for: describing pictures costs more than most decisions.
    """

    @property
    def frames(self) -> tuple[PictureFrame, ...]:
        """Where the world appears in each picture."""
        ...

    def describe(self, picture: int, num_parts: int, parts: np.ndarray) -> np.ndarray:
        """Describe parts of a picture, each as a picture of its own.

        Args:
            picture: Index of the picture.
            num_parts: G, parts along each side; 1 describes the picture as a whole.
            parts: (M,) numbers of parts, as `PictureFrame.parts_of` gives them.

        Returns:
            (M, C) float32 features in the text's space, unit length.
        """
        ...
