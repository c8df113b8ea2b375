"""Hands the pictures of a look to the policies that ask for them."""

from dataclasses import dataclass

import numpy as np

from perception.encoders.base import Encoder
from perception.parts import describe_parts
from perception.views import CameraView
from policy.images import PictureFrame


@dataclass(frozen=True, kw_only=True, eq=False)
class ViewImages:
    """The pictures of a look as a `policy.images.ImageSource`.

    Attributes:
        views: What the cameras saw.
        encoder: Describes the pictures, once it is asked to.
    """

    views: tuple[CameraView, ...]
    encoder: Encoder

    @property
    def frames(self) -> tuple[PictureFrame, ...]:
        """Where the world appears in each picture."""
        return tuple(
            PictureFrame(
                P_pixel_world=view.intrinsics.matrix() @ view.T_cam_cv_world[:3],
                width=view.intrinsics.width,
                height=view.intrinsics.height,
            )
            for view in self.views
        )

    def describe(self, picture: int, num_parts: int, parts: np.ndarray) -> np.ndarray:
        """Describe parts of a picture, each as a picture of its own.

        Args:
            picture: Index of the view.
            num_parts: G, parts along each side; 1 describes the picture as a whole.
            parts: (M,) numbers of parts; see `perception.parts.describe_parts`.

        Returns:
            (M, C) float32 features in the text's space, unit length.
        """
        return describe_parts(self.encoder, self.views[picture].rgb, num_parts, parts)
