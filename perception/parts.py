"""Features of the parts of an image, each part encoded as an image of its own."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from perception.encoders.base import Encoder, stacked_images
from perception.errors import InvalidConfigError

if TYPE_CHECKING:
    from perception.encoders.embedded import EmbeddedEncoder

_MULTIPLE_PX = 32


def describe_parts(
    encoder: Encoder, image: np.ndarray, num_parts: int, parts: Sequence[int] | np.ndarray
) -> np.ndarray:
    """Cut an image into a grid and describe some of its parts by one feature each.

    The feature of a part is the mean of the encoder's map of that part alone, normalised. For
    towers that pool their patches by the mean that is the tower's own embedding of the crop; for
    others, and for the embedded encoder, it is the nearest thing that every encoder offers.

    Args:
        encoder: Image tower.
        image: (H, W, 3) uint8 RGB.
        num_parts: G, parts along each side; 1 describes the image as a whole.
        parts: (M,) numbers 0..G * G - 1 of the parts: row times G plus column, from the top left.

    Returns:
        (M, C) float32 in text space, unit length.

    Raises:
        InvalidConfigError: If a part would be smaller than a pixel, or does not exist.
        InvalidViewError: If the image is no RGB image.
    """
    height, width = stacked_images([image]).shape[1:3]
    if not 1 <= num_parts <= min(height, width):
        raise InvalidConfigError(
            f"num_parts is {num_parts}, expected 1 to {min(height, width)} for an image of "
            f"{width}x{height} pixels."
        )
    outside = [int(part) for part in parts if not 0 <= part < num_parts**2]
    if outside:
        raise InvalidConfigError(
            f"parts holds {outside[0]}, expected numbers from 0 to {num_parts**2 - 1}."
        )
    rows, columns = part_edges(height, num_parts), part_edges(width, num_parts)
    features = torch.empty(len(parts), encoder.feature_dim)
    for feature, part in zip(features, parts, strict=True):
        i, j = divmod(int(part), num_parts)
        crop = np.ascontiguousarray(image[rows[i] : rows[i + 1], columns[j] : columns[j + 1]])
        feature[:] = _encode_part(encoder, crop, (height, width), num_parts).mean(dim=(0, 1))
    return F.normalize(features, dim=-1).numpy()


def part_edges(length: int, num_parts: int) -> np.ndarray:
    """Return where the parts of a side begin and end.

    A pixel belongs to the part in which its centre lies, so that pixel p is in part
    floor((p + 0.5) / length * num_parts).

    Args:
        length: Pixels of the side.
        num_parts: Parts along it.

    Returns:
        (num_parts + 1,) int64: part i holds the pixels from edge i up to, without, edge i + 1.
    """
    # Whole numbers: the ceiling of i * length / num_parts - 1/2.
    return -((num_parts - 2 * np.arange(num_parts + 1) * length) // (2 * num_parts))


def _encode_part(
    encoder: Encoder, part: np.ndarray, image_size: tuple[int, int], num_parts: int
) -> Tensor:
    """Return the (h, w, C) map of a part."""
    from perception.encoders.embedded import EmbeddedEncoder

    if num_parts > 1 and isinstance(encoder, EmbeddedEncoder):
        return _encode_at_scale(encoder, part, image_size, num_parts)
    return encoder.encode_dense([part])[0].permute(1, 2, 0)


@torch.no_grad()
def _encode_at_scale(
    encoder: "EmbeddedEncoder", part: np.ndarray, image_size: tuple[int, int], num_parts: int
) -> Tensor:
    """Encode a part at the scale at which the embedded encoder would see the image.

    CLIP was trained on things that fill the picture, and a crop is enlarged to its input. The
    embedded encoder was trained on tables of things at one scale: it knows a crop that is enlarged
    several times less well, and would take as long for it as for the whole image.
    """
    from perception.encoders.efficientnet import cell_features, to_network_input

    height, width = (
        max(_MULTIPLE_PX, round(side / num_parts / _MULTIPLE_PX) * _MULTIPLE_PX)
        for side in encoder.network_size(*image_size)
    )
    pixels = torch.from_numpy(part)[None].permute(0, 3, 1, 2)
    network_input = to_network_input(pixels, (height, width), encoder.config.dtype())
    return encoder.describe_cells(cell_features(encoder.trunk, network_input))[0]
