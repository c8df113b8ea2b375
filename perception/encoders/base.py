"""What every encoder offers: dense image features and text features in one space."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, get_args, runtime_checkable

import numpy as np
import torch

from perception.arrays import checked_array
from perception.errors import (
    InvalidCloudError,
    InvalidConfigError,
    InvalidTextError,
    InvalidViewError,
)

Precision = Literal["auto", "float32", "bfloat16"]


@dataclass(frozen=True, kw_only=True, eq=False)
class TextFeatures:
    """Features of one text.

    Attributes:
        pooled: (C,) float32, unit length; what image features are compared with.
        tokens: (T, C) float32, one row for each valid token (no padding), as the text tower ends.
    """

    pooled: np.ndarray
    tokens: np.ndarray

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        spec = {"owner": "TextFeatures", "dtype": np.float32, "error": InvalidCloudError}
        pooled = checked_array(name="pooled", value=self.pooled, shape=("C",), **spec)
        tokens = checked_array(
            name="tokens", value=self.tokens, shape=("T", pooled.shape[0]), **spec
        )
        object.__setattr__(self, "pooled", pooled)
        object.__setattr__(self, "tokens", tokens)


@runtime_checkable
class Encoder(Protocol):
    """A pair of image and text towers that share a feature space of C dimensions."""

    @property
    def name(self) -> str:
        """Name under which `perception.encoders.load_encoder` finds the encoder."""
        ...

    @property
    def fingerprint(self) -> str:
        """A short text that changes whenever the same image could give other features."""
        ...

    @property
    def fingerprints(self) -> tuple[str, ...]:
        """Fingerprints of the same encoder in every arithmetic, its own among them.

        Their features agree up to rounding, so that what was learnt from one serves the others.
        """
        ...

    @property
    def feature_dim(self) -> int:
        """C, the dimension of the shared feature space."""
        ...

    def encode_dense(self, images: Sequence[np.ndarray]) -> torch.Tensor:
        """Encode images into feature maps in text space.

        The h x w cells of a map divide the image evenly: the centre of cell (i, j) lies at pixel
        ((j + 0.5) W / w - 0.5, (i + 0.5) H / h - 0.5), pixel centres at integers.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, C, h, w) float32, each cell of unit length; best a view of memory in which channels
            are innermost, which lifting reads without a copy.
        """
        ...

    def encode_text(self, text: str) -> TextFeatures:
        """Encode one text.

        Args:
            text: Any text with at least one word.

        Returns:
            Its features.
        """
        ...


@runtime_checkable
class CellEncoder(Encoder, Protocol):
    """An encoder that turns each cell of its maps into text space on its own.

    `encode_dense` is `describe_cells` of all cells of `encode_cells`. A scene's points fall into a
    part of the cells only; `perception.lifting` describes no others.
    """

    def encode_cells(self, images: Sequence[np.ndarray]) -> torch.Tensor:
        """Encode images into cells, which are not yet in text space.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, h, w, M) in any floating type, the same h and w as of `encode_dense`.
        """
        ...

    def describe_cells(self, cells: torch.Tensor) -> torch.Tensor:
        """Turn cells into features in text space.

        Args:
            cells: (..., M) of `encode_cells`.

        Returns:
            (..., C) float32, unit length.
        """
        ...


def stacked_images(images: Sequence[np.ndarray]) -> np.ndarray:
    """Check images of one size and stack them.

    Args:
        images: V >= 1 images, each (H, W, 3) uint8.

    Returns:
        (V, H, W, 3) uint8.

    Raises:
        InvalidViewError: If there is none, one is no RGB image, or the sizes differ.
    """
    if len(images) == 0:
        raise InvalidViewError("No image to encode: expected at least one (H, W, 3) uint8 image.")
    height, width = images[0].shape[:2] if images[0].ndim == 3 else ("H", "W")
    return np.stack(
        [
            checked_array(
                f"image {index}",
                "rgb",
                image,
                shape=(height, width, 3),
                dtype=np.uint8,
                error=InvalidViewError,
            )
            for index, image in enumerate(images)
        ]
    )


def checked_text(text: str) -> str:
    """Return the text without surrounding white space.

    Args:
        text: What is to be encoded.

    Returns:
        The stripped text.

    Raises:
        InvalidTextError: If nothing is left.
    """
    stripped = text.strip()
    if not stripped:
        raise InvalidTextError(f"Empty text {text!r}: expected at least one word.")
    return stripped


PRECISIONS = (torch.float32, torch.bfloat16)
"""Types in which an image tower may compute."""


def compute_dtype(precision: Precision) -> torch.dtype:
    """Return the type in which an image tower computes on this machine.

    Args:
        precision: `auto` takes bfloat16 where the CPU multiplies it natively (AMX, AVX512-BF16) and
            float32 elsewhere; features then differ slightly between machines.

    Returns:
        The type.

    Raises:
        InvalidConfigError: If there is no such precision.
    """
    if precision not in get_args(Precision):
        names = ", ".join(get_args(Precision))
        raise InvalidConfigError(f"Unknown precision {precision!r}. Precisions: {names}.")
    if precision == "auto":
        is_native = torch.cpu._is_amx_tile_supported() or torch.cpu._is_avx512_bf16_supported()
        return torch.bfloat16 if is_native else torch.float32
    return torch.bfloat16 if precision == "bfloat16" else torch.float32
