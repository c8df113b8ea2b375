from collections.abc import Sequence

import numpy as np
import pytest
import torch
import torch.nn.functional as F

from perception.encoders.base import TextFeatures
from perception.encoders.embedded import EmbeddedEncoder, EmbeddedEncoderConfig
from perception.errors import InvalidConfigError
from perception.parts import describe_parts, part_edges


class ColorEncoder:
    """Every pixel is a cell, its feature the colour."""

    name = fingerprint = "color"
    fingerprints = ("color",)
    feature_dim = 3

    def encode_dense(self, images: Sequence[np.ndarray]) -> torch.Tensor:
        return torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2).float()

    def encode_text(self, text: str) -> TextFeatures:
        raise NotImplementedError


@pytest.fixture(scope="module")
def embedded() -> EmbeddedEncoder:
    return EmbeddedEncoder(EmbeddedEncoderConfig(long_side=192, precision="float32"))


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 256, (96, 192, 3), dtype=np.uint8)


def _normalized(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@pytest.mark.parametrize("length", [1, 7, 90, 720, 1280])
@pytest.mark.parametrize("num_parts", [1, 2, 3, 7, 8])
def test_each_pixel_is_in_the_part_that_holds_its_centre(length: int, num_parts: int) -> None:
    if num_parts > length:
        return
    edges = part_edges(length, num_parts)
    pixels = np.arange(length)
    found = np.searchsorted(edges, pixels, side="right") - 1
    # Whole numbers on both sides: no rounding decides.
    np.testing.assert_array_equal(found, (2 * pixels + 1) * num_parts // (2 * length))
    assert (edges[0], edges[-1]) == (0, length)
    assert np.diff(edges).min() >= 1 and np.ptp(np.diff(edges)) <= 1


@pytest.mark.parametrize(("height", "width"), [(96, 192), (50, 71)])
def test_a_part_is_described_by_the_mean_over_its_own_pixels(height: int, width: int) -> None:
    image = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
    row = ((2 * np.arange(height) + 1) * 4 // (2 * height))[:, None]
    column = (2 * np.arange(width) + 1) * 4 // (2 * width)
    owner = row * 4 + column
    means = np.array([image[owner == part].mean(axis=0) for part in range(16)])
    found = describe_parts(ColorEncoder(), image, 4, range(16))
    np.testing.assert_allclose(found, _normalized(means), atol=1e-6)
    assert found.dtype == np.float32


def test_the_whole_image_is_described_by_the_mean_of_its_map(
    embedded: EmbeddedEncoder, image: np.ndarray
) -> None:
    mean = embedded.encode_dense([image])[0].mean(dim=(1, 2))
    found = describe_parts(embedded, image, 1, [0])
    np.testing.assert_allclose(found[0], F.normalize(mean, dim=0), atol=1e-6)


def test_the_embedded_encoder_sees_parts_at_the_scale_of_the_image(
    embedded: EmbeddedEncoder, image: np.ndarray
) -> None:
    # A third of an image that is encoded 192 pixels long: an image that is encoded 64 pixels long.
    small = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=64, precision="float32"))
    crop = np.ascontiguousarray(image[32:64, 128:192])
    expected = F.normalize(small.encode_dense([crop])[0].mean(dim=(1, 2)), dim=0)
    np.testing.assert_allclose(
        describe_parts(embedded, image, 3, [5])[0], expected.numpy(), atol=1e-6
    )


def test_a_part_knows_nothing_of_the_others(embedded: EmbeddedEncoder, image: np.ndarray) -> None:
    found = describe_parts(embedded, image, 3, [4, 0, 8])
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-5)
    changed = np.full_like(image, 90)
    changed[32:64, 64:128] = image[32:64, 64:128]
    assert describe_parts(embedded, changed, 3, [4]).tobytes() == found[:1].tobytes()
    assert not np.allclose(describe_parts(embedded, changed, 3, [0]), found[1:2], atol=0.01)


def test_no_parts(image: np.ndarray) -> None:
    assert describe_parts(ColorEncoder(), image, 3, []).shape == (0, 3)


@pytest.mark.parametrize(
    ("num_parts", "parts", "message"),
    [
        (0, [0], "num_parts is 0, expected 1 to 96 for an image of 192x96 pixels."),
        (97, [0], "num_parts is 97, expected 1 to 96 for an image of 192x96 pixels."),
        (3, [0, 9], "parts holds 9, expected numbers from 0 to 8."),
        (3, [-1], "parts holds -1, expected numbers from 0 to 8."),
    ],
)
def test_bad_parts(image: np.ndarray, num_parts: int, parts: list[int], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        describe_parts(ColorEncoder(), image, num_parts, parts)
    assert str(caught.value) == message
