"""An encoder that sees nothing, for policies that do not look at features."""

from collections.abc import Sequence

import numpy as np
import torch

from perception.encoders.base import TextFeatures, stacked_images

_CELL_PX = 80


class BlankEncoder:
    """Gives every cell and every text the same feature; geometry does not depend on it."""

    name = "blank"
    fingerprint = "blank"
    fingerprints = ("blank",)
    feature_dim = 4

    def encode_dense(self, images: Sequence[np.ndarray]) -> torch.Tensor:
        """Return (V, 4, H / 80, W / 80) maps of one constant unit feature."""
        num, height, width = stacked_images(images).shape[:3]
        shape = (num, self.feature_dim, max(height // _CELL_PX, 1), max(width // _CELL_PX, 1))
        return torch.full(shape, self.feature_dim**-0.5)

    def encode_text(self, text: str) -> TextFeatures:
        """Return the same feature for any text."""
        pooled = np.full(self.feature_dim, self.feature_dim**-0.5, np.float32)
        return TextFeatures(pooled=pooled, tokens=pooled[None])
