import shutil
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from timm.layers import Conv2dSame

from perception.encoders import efficientnet
from perception.encoders.base import CellEncoder, Encoder
from perception.encoders.efficientnet import NUM_CELL_FEATURES
from perception.encoders.embedded import (
    WEIGHTS_DIR,
    EmbeddedEncoder,
    EmbeddedEncoderConfig,
)
from perception.encoders.head import GroundingHead
from perception.errors import (
    InvalidConfigError,
    InvalidTextError,
    InvalidViewError,
    InvalidWeightsError,
    MissingWeightsError,
)

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "embedded_encoder.npz"
MAX_BYTES = 64_000_000


@pytest.fixture(scope="module")
def encoder() -> EmbeddedEncoder:
    return EmbeddedEncoder(EmbeddedEncoderConfig(long_side=160, precision="float32"))


@pytest.fixture(scope="module")
def golden() -> dict[str, np.ndarray]:
    with np.load(GOLDEN) as arrays:
        return dict(arrays)


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 256, (90, 160, 3), dtype=np.uint8)


def test_it_is_an_encoder(encoder: EmbeddedEncoder) -> None:
    assert isinstance(encoder, Encoder)
    assert (encoder.name, encoder.feature_dim) == ("embedded", 384)


def test_weights_are_small() -> None:
    assert sum(file.stat().st_size for file in WEIGHTS_DIR.iterdir()) <= MAX_BYTES


def test_text_equals_the_original_model(
    encoder: EmbeddedEncoder, golden: dict[str, np.ndarray]
) -> None:
    for text, wanted in zip(golden["texts"], golden["text_pooled"], strict=True):
        features = encoder.encode_text(str(text))
        np.testing.assert_allclose(features.pooled, wanted, atol=5e-4)  # stored in half precision
        np.testing.assert_allclose(np.linalg.norm(features.pooled), 1.0, atol=1e-6)


def test_text_ignores_case_and_surrounding_space(encoder: EmbeddedEncoder) -> None:
    first, second = (
        encoder.encode_text("give me the pear"),
        encoder.encode_text(" Give me the PEAR "),
    )
    np.testing.assert_array_equal(first.pooled, second.pooled)
    assert first.tokens.shape == (6, 384)  # [CLS] give me the pear [SEP]


def test_pooled_text_is_the_mean_of_its_tokens(encoder: EmbeddedEncoder) -> None:
    features = encoder.encode_text("a red mug")
    mean = features.tokens.mean(axis=0)
    np.testing.assert_allclose(features.pooled, mean / np.linalg.norm(mean), atol=1e-6)


def test_long_text_is_cut(encoder: EmbeddedEncoder) -> None:
    assert encoder.encode_text("pear " * 1000).tokens.shape == (256, 384)


def test_mean_of_dense_logits_is_the_pooled_classification(
    encoder: EmbeddedEncoder, image: np.ndarray
) -> None:
    features = encoder.encode_trunk([image])
    dense_mean = encoder.head.mixture.class_logits(features).mean(dim=(1, 2))
    pooled = encoder.head.mixture.class_logits(features.mean(dim=(1, 2)))
    assert (dense_mean - pooled).abs().max() < 1e-4


def test_dense_features_equal_the_golden_ones(golden: dict[str, np.ndarray]) -> None:
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32"))
    dense = encoder.encode_dense([golden["image"]])[0, :, ::8, ::8].numpy()
    cosine = np.einsum("chw,chw->hw", dense, golden["dense_corner"])
    assert cosine.min() > 0.999


def test_full_share_is_the_untrained_mixture(golden: dict[str, np.ndarray]) -> None:
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32", mixture_share=1.0))
    dense = encoder.encode_dense([golden["image"]])[0, :, ::8, ::8].numpy()
    cosine = np.einsum("chw,chw->hw", dense, golden["mixture_corner"])
    assert cosine.min() > 0.999
    assert np.einsum("chw,chw->hw", dense, golden["dense_corner"]).max() < 0.99


def test_texts_together_equal_texts_alone(encoder: EmbeddedEncoder) -> None:
    texts = ["pear", "a red mug", "plum", "something to eat", "a blue mug"]
    alone = np.stack([encoder.encode_text(text).pooled for text in texts])
    np.testing.assert_allclose(encoder.encode_texts(texts), alone, atol=1e-5)


def test_head_adds_unit_vectors_by_share() -> None:
    torch.manual_seed(0)
    head = GroundingHead(num_classes=7, text_dim=5)
    torch.nn.init.normal_(head.mixture.class_embeddings)
    head.mixture_share.fill_(0.3)
    cells = torch.randn(4, NUM_CELL_FEATURES)
    trained = F.relu(cells @ head.hidden.weight.T + head.hidden.bias) @ head.projection.weight.T
    trained = trained + head.projection.bias
    classes = torch.softmax(
        (cells[:, :1280] @ head.mixture.classifier.weight.T + head.mixture.classifier.bias) / 2, 1
    )
    names = head.mixture.class_embeddings
    mixture = classes @ (names - names.mean(0))
    expected = 0.7 * trained / trained.norm(dim=1, keepdim=True)
    expected = expected + 0.3 * mixture / mixture.norm(dim=1, keepdim=True)
    expected = expected / expected.norm(dim=1, keepdim=True)
    torch.testing.assert_close(head(cells, 2.0), expected)


def test_cells_hold_what_their_names_say(encoder: EmbeddedEncoder, image: np.ndarray) -> None:
    cells = encoder.encode_cells([image])
    assert cells.shape == (1, 6, 10, NUM_CELL_FEATURES)
    torch.testing.assert_close(cells[..., :1280], encoder.encode_trunk([image]))
    flat = np.full((96, 160, 3), (255, 0, 51), np.uint8)
    colors = encoder.encode_cells([flat])[0, ..., -48:]
    torch.testing.assert_close(
        colors, torch.tensor([1.0, -1.0, -0.6]).repeat_interleave(16).expand_as(colors)
    )


def test_map_is_of_unit_length_and_divides_the_image(
    encoder: EmbeddedEncoder, image: np.ndarray
) -> None:
    dense = encoder.encode_dense([image, image[::-1].copy()])
    assert dense.shape == (2, 384, 6, 10)
    torch.testing.assert_close(dense.norm(dim=1), torch.ones(2, 6, 10))


def test_same_image_same_bytes(encoder: EmbeddedEncoder, image: np.ndarray) -> None:
    first, second = encoder.encode_dense([image]), encoder.encode_dense([image])
    assert first.numpy().tobytes() == second.numpy().tobytes()


def _discs(height: int, width: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    v, u = np.mgrid[:height, :width]
    image = np.full((height, width, 3), 150, np.uint8)
    for _ in range(25):
        x, y, radius = rng.uniform((0, 0, 15), (width, height, 50))
        image[(u - x) ** 2 + (v - y) ** 2 < radius**2] = rng.integers(0, 256, 3)
    return image


def test_padding_within_convolutions_changes_nothing() -> None:
    torch.manual_seed(0)
    trunk = efficientnet.perception_efficientnet_lite0().eval().double()
    pixels = torch.randn(1, 3, 64, 96, dtype=torch.float64)
    with torch.no_grad():
        wanted = trunk.forward_features(pixels)
        found = efficientnet.pad_within_convolutions(trunk).forward_features(pixels)
    torch.testing.assert_close(found, wanted, atol=1e-10, rtol=1e-10)
    assert not any(isinstance(module, Conv2dSame) for module in trunk.modules())


def test_dense_features_are_the_described_cells(
    encoder: EmbeddedEncoder, image: np.ndarray
) -> None:
    assert isinstance(encoder, CellEncoder)
    described = encoder.describe_cells(encoder.encode_cells([image]))
    torch.testing.assert_close(encoder.encode_dense([image]), described.permute(0, 3, 1, 2))


def test_whole_steps_of_brightness_suffice_for_bfloat16() -> None:
    rng = np.random.default_rng(0)
    image = torch.from_numpy(rng.integers(0, 256, (1, 3, 72, 128), dtype=np.uint8))
    exact = efficientnet.to_network_input(image, (64, 96))
    rough = efficientnet.to_network_input(image, (64, 96), torch.bfloat16)
    assert rough.dtype == torch.bfloat16
    assert (rough.float() - exact).abs().max() < 1.6 / 127.5


def test_cells_look_at_their_middle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mirroring commutes with encoding only if cells look neither to the left nor to the right."""
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=640, precision="float32"))
    image = _discs(384, 640)

    def agreement(alignment_px: int) -> float:
        monkeypatch.setattr(efficientnet, "_ALIGNMENT_PX", alignment_px)
        logits = encoder.head.mixture.class_logits(encoder.encode_trunk([image, image[:, ::-1]]))
        logits = logits - logits.mean(dim=(1, 2), keepdim=True)
        agreeing = F.cosine_similarity(logits[0], logits[1].flip(1), dim=2)
        return agreeing[3:-3, 3:-3].mean().item()

    assert agreement(6) > max(agreement(1), agreement(11)) + 0.02


def test_network_input_is_aligned() -> None:
    pixels = torch.arange(64, dtype=torch.uint8).expand(1, 3, 64, 64)
    moved = efficientnet.to_network_input(pixels, (64, 64)) * 127.5 + 127.5
    torch.testing.assert_close(moved[0, 0, 0, :58], torch.arange(6.0, 64.0))
    torch.testing.assert_close(moved[0, 0, 0, 58:], torch.full((6,), 63.0))


def test_bfloat16_agrees_with_float32(encoder: EmbeddedEncoder, image: np.ndarray) -> None:
    rough = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=160, precision="bfloat16"))
    cosine = F.cosine_similarity(rough.encode_dense([image]), encoder.encode_dense([image]))
    assert cosine.median() > 0.98
    assert rough.fingerprint != encoder.fingerprint


def test_fingerprint_depends_on_the_settings(encoder: EmbeddedEncoder) -> None:
    other = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=192, precision="float32"))
    again = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=160, precision="float32"))
    assert other.fingerprint != encoder.fingerprint == again.fingerprint


def test_nothing_reaches_the_network(monkeypatch: pytest.MonkeyPatch, image: np.ndarray) -> None:
    def refuse(*args: object, **kwargs: object) -> None:
        raise AssertionError(f"network access: {args}")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    fresh = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=160))
    fresh.encode_dense([image])
    fresh.encode_text("pear")


def test_missing_weights(tmp_path: Path) -> None:
    with pytest.raises(MissingWeightsError) as caught:
        EmbeddedEncoder(weights_dir=tmp_path)
    assert str(caught.value) == (
        "The embedded encoder misses image.safetensors, head.safetensors, text.safetensors, "
        f"tokenizer.json, config.json in {tmp_path}; expected image.safetensors, head.safetensors, "
        "text.safetensors, tokenizer.json, config.json. Reinstall the package, or make them with "
        "`python -m tools.convert_embedded_weights` and "
        "`python -m tools.train_embedded_encoder export`."
    )


@pytest.mark.parametrize(
    ("file", "module", "command"),
    [
        ("image.safetensors", "EfficientNet", "python -m tools.convert_embedded_weights"),
        ("head.safetensors", "ModuleDict", "python -m tools.train_embedded_encoder export"),
    ],
)
def test_weights_of_another_model(tmp_path: Path, file: str, module: str, command: str) -> None:
    for source in WEIGHTS_DIR.iterdir():
        shutil.copy(source, tmp_path)
    shutil.copy(tmp_path / "text.safetensors", tmp_path / file)
    with pytest.raises(InvalidWeightsError) as caught:
        EmbeddedEncoder(weights_dir=tmp_path)
    assert str(caught.value) == (
        f"{tmp_path / file} does not fit {module}: expected the tensors that `{command}` writes. "
        "Run it again."
    )


def test_bad_images(encoder: EmbeddedEncoder, image: np.ndarray) -> None:
    cases = (
        ([], "No image to encode: expected at least one (H, W, 3) uint8 image."),
        ([image, image[:50]], "image 1: rgb is uint8 (50, 160, 3), expected uint8 (90, 160, 3)."),
        ([image[..., 0]], "image 0: rgb is uint8 (90, 160), expected uint8 (H, W, 3)."),
        (
            [image / np.float32(255)],
            "image 0: rgb is float32 (90, 160, 3), expected uint8 (90, 160, 3).",
        ),
    )
    for images, message in cases:
        with pytest.raises(InvalidViewError) as caught:
            encoder.encode_dense(images)
        assert str(caught.value) == message


def test_empty_text(encoder: EmbeddedEncoder) -> None:
    with pytest.raises(InvalidTextError) as caught:
        encoder.encode_text("  ")
    assert str(caught.value) == "Empty text '  ': expected at least one word."


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"long_side": 100}, "long_side is 100, expected a positive multiple of 32."),
        ({"mixture_share": 1.5}, "mixture_share is 1.5, expected a number in 0..1 or None."),
        ({"temperature": 0.0}, "temperature is 0.0, expected a positive number."),
        (
            {"precision": "float16"},
            "Unknown precision 'float16'. Precisions: auto, float32, bfloat16.",
        ),
    ],
)
def test_bad_config(fields: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        EmbeddedEncoderConfig(**fields)  # pyright: ignore[reportArgumentType]
    assert str(caught.value) == message


def test_importing_the_package_is_light_and_alone() -> None:
    heavy = ("torch", "open3d", "open_clip", "mujoco", "dm_control", "mink", "policy", "models")
    code = f"import perception, sys; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
