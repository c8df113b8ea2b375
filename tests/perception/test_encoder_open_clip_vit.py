import zipfile
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import open_clip
import pytest
import torch
import torch.nn.functional as F
from open_clip.model import CLIP
from safetensors.torch import save_file

from perception.encoders.base import Encoder
from perception.encoders.clip_weights import ClipWeights, resolve_weights
from perception.encoders.open_clip_vit import OpenClipVitEncoder, VitConfig
from perception.encoders.tiling import blend, image_windows
from perception.errors import InvalidConfigError, InvalidTextError, InvalidWeightsError

GRID = (4, 4)
MEAN, STD = (0.5, 0.4, 0.3), (0.2, 0.25, 0.3)


@pytest.fixture(scope="module")
def clip() -> CLIP:
    """A CLIP of open_clip's own classes, tiny and random."""
    torch.manual_seed(0)
    vision = {"image_size": 32, "patch_size": 8, "width": 48, "layers": 3, "head_width": 16}
    text = {"context_length": 77, "vocab_size": 49408, "width": 32, "heads": 2, "layers": 2}
    return CLIP(24, vision, text, quick_gelu=True).eval()  # pyright: ignore[reportArgumentType]


EXACT = VitConfig(precision="float32")


def _encoder(clip: CLIP, config: VitConfig = EXACT) -> OpenClipVitEncoder:
    return OpenClipVitEncoder(
        deepcopy(clip), architecture="ViT-B-16", source="tiny", mean=MEAN, std=STD, config=config
    )


def _value_path_by_hand(state: dict[str, torch.Tensor], pixels: np.ndarray) -> np.ndarray:
    """Rebuild the value path from raw weights with plain array arithmetic, in float64."""
    visual = {k.removeprefix("visual."): t for k, t in state.items() if k.startswith("visual.")}
    w = {name: tensor.double() for name, tensor in visual.items()}

    def norm(x: torch.Tensor, name: str) -> torch.Tensor:
        x = x - x.mean(-1, keepdim=True)
        x = x / (x.pow(2).mean(-1, keepdim=True) + 1e-5).sqrt()
        return x * w[f"{name}.weight"] + w[f"{name}.bias"]

    patches = torch.from_numpy(pixels).double().reshape(3, 4, 8, 4, 8).permute(1, 3, 0, 2, 4)
    x = patches.reshape(16, -1) @ w["conv1.weight"].reshape(48, -1).T
    x = torch.cat([w["class_embedding"][None], x]) + w["positional_embedding"]
    x = norm(x, "ln_pre")
    for i in range(2):
        block = f"transformer.resblocks.{i}"
        y = norm(x, f"{block}.ln_1") @ w[f"{block}.attn.in_proj_weight"].T
        q, k, v = (y + w[f"{block}.attn.in_proj_bias"]).reshape(17, 3, 3, 16).permute(1, 2, 0, 3)
        mixed = ((q @ k.transpose(1, 2)) / 4.0).softmax(-1) @ v
        mixed = mixed.transpose(0, 1).reshape(17, 48) @ w[f"{block}.attn.out_proj.weight"].T
        x = x + mixed + w[f"{block}.attn.out_proj.bias"]
        y = norm(x, f"{block}.ln_2") @ w[f"{block}.mlp.c_fc.weight"].T + w[f"{block}.mlp.c_fc.bias"]
        y = y * torch.sigmoid(1.702 * y)
        x = x + y @ w[f"{block}.mlp.c_proj.weight"].T + w[f"{block}.mlp.c_proj.bias"]
    last = "transformer.resblocks.2"
    x = norm(x[1:], f"{last}.ln_1") @ w[f"{last}.attn.in_proj_weight"][96:].T
    x = (x + w[f"{last}.attn.in_proj_bias"][96:]) @ w[f"{last}.attn.out_proj.weight"].T
    x = norm(x + w[f"{last}.attn.out_proj.bias"], "ln_post") @ w["proj"]
    return (x / x.norm(dim=-1, keepdim=True)).reshape(4, 4, 24).numpy()


def test_value_path_equals_a_rebuild_by_hand(clip: CLIP) -> None:
    pixels = np.random.default_rng(0).normal(size=(3, 32, 32)).astype(np.float32)
    with torch.no_grad():
        ours = _encoder(clip).value_features(torch.from_numpy(pixels)[None], GRID)[0].numpy()
    np.testing.assert_allclose(ours, _value_path_by_hand(clip.state_dict(), pixels), atol=1e-5)


def test_it_is_an_encoder(clip: CLIP) -> None:
    encoder = _encoder(clip)
    assert isinstance(encoder, Encoder)
    assert (encoder.name, encoder.feature_dim) == ("ViT-B-16:tiny", 24)


def test_text_equals_open_clip(clip: CLIP) -> None:
    features = _encoder(clip).encode_text("give me the pear")
    ids = open_clip.get_tokenizer("ViT-B-16")(["give me the pear"])
    with torch.no_grad():
        wanted = F.normalize(clip.encode_text(ids), dim=-1)[0].numpy()
    np.testing.assert_allclose(features.pooled, wanted, atol=1e-6)
    assert features.tokens.shape == (6, 24)  # start, give, me, the, pear, end
    np.testing.assert_allclose(
        features.tokens[-1] / np.linalg.norm(features.tokens[-1]), wanted, atol=1e-6
    )


def test_aspect_ratio_is_kept_and_tiles_add_resolution(clip: CLIP) -> None:
    image = np.random.default_rng(1).integers(0, 256, (72, 128, 3), dtype=np.uint8)
    whole = _encoder(clip, replace(EXACT, num_tiles=0)).encode_dense([image])
    assert whole.shape == (1, 24, 4, 7)
    tiled = _encoder(clip).encode_dense([image, image])
    assert tiled.shape == (2, 24, 7, 12)
    torch.testing.assert_close(tiled.norm(dim=1), torch.ones(2, 7, 12))
    torch.testing.assert_close(tiled[0], tiled[1])


def test_whole_image_alone_is_the_plain_pass(clip: CLIP) -> None:
    image = np.random.default_rng(2).integers(0, 256, (32, 32, 3), dtype=np.uint8)
    encoder = _encoder(clip, replace(EXACT, num_tiles=0))
    pixels = (image / 255.0 - MEAN) / STD
    with torch.no_grad():
        plain = encoder.value_features(
            torch.from_numpy(pixels).permute(2, 0, 1)[None].float(), GRID
        ).permute(0, 3, 1, 2)
    torch.testing.assert_close(encoder.encode_dense([image]), plain, atol=1e-5, rtol=0)


def test_constant_image_gives_one_feature_under_any_tiling(clip: CLIP) -> None:
    """Blending is a weighted mean: where all windows agree, it changes nothing."""
    clip = deepcopy(clip)
    positions = cast(torch.Tensor, clip.visual.positional_embedding)
    with torch.no_grad():
        positions[1:] = positions[1]
    image = np.full((32, 32, 3), 90, np.uint8)
    whole = _encoder(clip, replace(EXACT, num_tiles=0)).encode_dense([image])[0, :, 0, 0]
    tiled = _encoder(clip, replace(EXACT, num_tiles=3)).encode_dense([image])[0]
    torch.testing.assert_close(tiled, whole[:, None, None].expand_as(tiled), atol=1e-5, rtol=0)


@pytest.mark.parametrize("batch_size", [1, 2, 100])
def test_batches_change_nothing(clip: CLIP, batch_size: int) -> None:
    image = np.random.default_rng(3).integers(0, 256, (2, 40, 64, 3), dtype=np.uint8)
    one = _encoder(clip, replace(EXACT, batch_size=batch_size)).encode_dense(list(image))
    torch.testing.assert_close(one, _encoder(clip).encode_dense(list(image)), atol=1e-5, rtol=0)


def test_bfloat16_is_near_float32_and_has_its_own_fingerprint(clip: CLIP) -> None:
    image = np.random.default_rng(4).integers(0, 256, (40, 64, 3), dtype=np.uint8)
    half, full = _encoder(clip, VitConfig(precision="bfloat16")), _encoder(clip)
    cosine = (half.encode_dense([image]) * full.encode_dense([image])).sum(dim=1)
    assert cosine.min() > 0.995
    assert half.fingerprint != full.fingerprint
    text = half.encode_text("pear").pooled
    np.testing.assert_array_equal(text, full.encode_text("pear").pooled)


def test_maps_have_channels_innermost(clip: CLIP) -> None:
    maps = _encoder(clip).encode_dense([np.zeros((32, 48, 3), np.uint8)])
    assert maps.is_contiguous(memory_format=torch.channels_last)


def test_tiles_show_their_own_part_of_the_image(clip: CLIP) -> None:
    """What one tile says reaches no cell outside of it."""
    windows = image_windows(2, 1 / 3)
    grids = torch.rand(len(windows), 1, 4, 4, 2)
    grids[0] = 0.0  # without the whole image only tiles speak
    other = grids.clone()
    other[4] += 1.0  # the tile at the lower right
    one, two = blend(grids, windows, (7, 7)), blend(other, windows, (7, 7))
    is_other = (one != two).any(dim=-1)[0]
    assert is_other[3:, 3:].all()
    assert not is_other[:2].any() and not is_other[:, :2].any()


def test_windows_cover_the_image_and_overlap() -> None:
    windows = image_windows(3, 0.25)
    assert len(windows) == 10
    tops = sorted({window.top for window in windows[1:]})
    size = windows[1].size
    assert tops[-1] + size == pytest.approx(1.0)
    assert (tops[0] + size - tops[1]) / size == pytest.approx(0.25)


def test_empty_text(clip: CLIP) -> None:
    with pytest.raises(InvalidTextError):
        _encoder(clip).encode_text(" ")


def test_file_that_does_not_fit(tmp_path: Path) -> None:
    path = tmp_path / "small.safetensors"
    save_file({"logit_scale": torch.zeros(())}, path)
    weights = ClipWeights(architecture="ViT-B-32", source=path.name, path=path, is_quick_gelu=False)
    with pytest.raises(InvalidWeightsError) as caught:
        OpenClipVitEncoder.from_weights(weights)
    message = str(caught.value)
    assert message.startswith(f"{path} does not hold weights of ViT-B-32 (")
    assert "\n" not in message


@pytest.mark.parametrize(("name", "is_quick"), [("my.safetensors", False), ("openai.pt", True)])
def test_quick_gelu_of_a_local_file(tmp_path: Path, name: str, is_quick: bool) -> None:
    (tmp_path / name).write_bytes(b"")
    weights = resolve_weights("ViT-L-14", str(tmp_path / name), allow_download=False)
    assert weights.is_quick_gelu == is_quick


def test_torchscript_archives_are_taken_for_openai(tmp_path: Path) -> None:
    path = tmp_path / "model.pt"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("model/code/__torch__.py", "")
    weights = resolve_weights("ViT-L-14", str(path), allow_download=False)
    assert weights.is_quick_gelu


@pytest.mark.parametrize(
    "fields", [{"num_tiles": -1}, {"tile_overlap": 1.0}, {"tile_overlap": -0.1}]
)
def test_bad_config(fields: dict[str, float]) -> None:
    with pytest.raises(InvalidConfigError, match=r"expected 0 or more and 0\.\.0\.9\."):
        VitConfig(**fields)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"batch_size": 0}, "batch_size is 0, expected 1 or more."),
        (
            {"precision": "half"},
            "Unknown precision 'half'. Precisions: auto, float32, bfloat16.",
        ),
    ],
)
def test_bad_batch_or_precision(fields: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        VitConfig(**fields)  # pyright: ignore[reportArgumentType]
    assert str(caught.value) == message
