"""Towers of open_clip besides CLIP's own vision transformer, tiny and random."""

from typing import Any

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from open_clip.model import CLIP, CustomTextCLIP
from timm.layers import AttentionPoolLatent
from timm.models import register_model
from timm.models.convnext import ConvNeXt
from timm.models.vision_transformer import VisionTransformer
from torch import Tensor, nn

from perception.encoders.image_towers import image_tower
from perception.encoders.open_clip_vit import OpenClipVitEncoder, VitConfig
from perception.errors import MissingWeightsError, UnsupportedEncoderError

TEXT = {"context_length": 77, "vocab_size": 49408, "width": 32, "heads": 2, "layers": 2}
OPEN_VIT = {"image_size": 32, "patch_size": 8, "width": 48, "layers": 2, "head_width": 16}
SIGLIP = {"timm_pool": "map", "timm_model_name": "tiny_siglip_for_tests"}


@pytest.fixture(scope="module", autouse=True)
def small_networks() -> None:
    """Register small networks under timm's own classes, as open_clip builds them by name."""
    for make in (tiny_siglip_for_tests, tiny_vit_for_tests, tiny_convnext_for_tests):
        make.__module__ = "timm.models.vision_transformer"
        register_model(make)


def tiny_vit_for_tests(pretrained: bool = False, **kwargs: Any) -> nn.Module:
    size = {"img_size": 32, "patch_size": 8, "embed_dim": 48, "depth": 2, "num_heads": 3}
    network = VisionTransformer(**size, **_own(kwargs))
    network.default_cfg = {}
    return network


def tiny_siglip_for_tests(pretrained: bool = False, **kwargs: Any) -> nn.Module:
    return tiny_vit_for_tests(**({"class_token": False, "global_pool": "map"} | kwargs))


def tiny_convnext_for_tests(pretrained: bool = False, **kwargs: Any) -> nn.Module:
    network = ConvNeXt(depths=(1, 1, 1, 1), dims=(8, 16, 24, 32), **_own(kwargs))
    network.default_cfg = {"pool_size": (2, 2)}
    return network


def _own(kwargs: dict[str, Any]) -> dict[str, Any]:
    """Leave out what `timm.create_model` passes on for its own loader."""
    return {
        k: v
        for k, v in kwargs.items()
        if k not in ("pretrained_cfg", "cache_dir") and "overlay" not in k
    }


def _model(vision: dict[str, Any], kind: type = CustomTextCLIP, **text: Any) -> Any:
    torch.manual_seed(0)
    model = kind(24, {"image_size": 32} | vision, TEXT | text).eval()
    # timm starts norms and biases at one and zero, where mistakes would not show.
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.add_(0.05 * torch.randn_like(parameter))
    return model


def _encoder(model: Any) -> OpenClipVitEncoder:
    return OpenClipVitEncoder(
        model,
        architecture="ViT-B-16",
        source="tiny",
        mean=(0.5, 0.5, 0.5),
        std=(0.5, 0.5, 0.5),
        config=VitConfig(precision="float32"),
    )


AVERAGING = [
    pytest.param(OPEN_VIT | {"pool_type": "avg"}, id="open_clip ViT"),
    pytest.param(OPEN_VIT | {"pool_type": "avg", "final_ln_after_pool": True}, id="norm after"),
    pytest.param({"timm_model_name": "tiny_vit_for_tests", "timm_pool": "avg"}, id="timm ViT"),
    pytest.param(
        {"timm_model_name": "tiny_vit_for_tests", "timm_pool": "avg", "timm_proj": None},
        id="timm ViT, norm after",
    ),
    pytest.param({"timm_model_name": "tiny_convnext_for_tests", "timm_pool": ""}, id="ConvNeXt"),
]


@torch.no_grad()
@pytest.mark.parametrize("vision", AVERAGING)
def test_mean_of_the_map_is_the_pooled_embedding(vision: dict[str, Any]) -> None:
    model = _model({"timm_proj": "linear"} | vision)
    size = 64 if "convnext" in vision.get("timm_model_name", "") else 32
    model.visual.image_size = (size, size)
    pixels = torch.randn(2, 3, size, size)
    tower = image_tower(model.visual, "tiny")
    cells = tower.read(pixels, tower.grid_size)
    assert cells.shape == (2, tower.grid_size[0] * tower.grid_size[1], 24)
    assert cells.std(dim=1).max() > 1e-3  # a map, not one vector everywhere
    torch.testing.assert_close(cells.mean(dim=1), model.encode_image(pixels), atol=1e-5, rtol=0)


@torch.no_grad()
def test_siglip_is_what_its_query_says_of_one_patch() -> None:
    """If the pool gets one patch alone, attention has no choice: that is the value path."""
    model = _model(SIGLIP | {"timm_proj": "linear"})
    trunk = model.visual.trunk
    assert isinstance(trunk.attn_pool, AttentionPoolLatent)
    pixels = torch.randn(1, 3, 32, 32)
    patches = trunk.forward_features(pixels)[0]
    alone = model.visual.head(trunk.forward_head(patches[:, None]))
    cells = image_tower(model.visual, "tiny").read(pixels, (4, 4))[0]
    torch.testing.assert_close(cells, alone, atol=1e-5, rtol=0)


@torch.no_grad()
def test_class_token_of_timm_is_read_by_the_last_blocks_values() -> None:
    model = _model(
        {"timm_model_name": "tiny_vit_for_tests", "timm_pool": "token"} | {"timm_proj": "linear"}
    )
    trunk = model.visual.trunk
    pixels = torch.randn(1, 3, 32, 32)
    x = trunk.norm_pre(trunk._pos_embed(trunk.patch_embed(pixels)))
    y = trunk.blocks[1].norm1(trunk.blocks[0](x))[:, 1:]
    qkv = y @ trunk.blocks[1].attn.qkv.weight.T + trunk.blocks[1].attn.qkv.bias
    y = trunk.norm(trunk.blocks[1].attn.proj(qkv[..., 96:]))
    cells = image_tower(model.visual, "tiny").read(pixels, (4, 4))
    torch.testing.assert_close(cells, model.visual.head(y), atol=1e-5, rtol=0)


@torch.no_grad()
@pytest.mark.parametrize("vision", [*AVERAGING, pytest.param(SIGLIP, id="SigLIP")])
def test_maps_of_wide_images(vision: dict[str, Any]) -> None:
    if "convnext" in vision.get("timm_model_name", ""):
        vision = vision | {"image_size": 64}
    encoder = _encoder(_model({"timm_proj": "linear"} | vision))
    image = np.random.default_rng(0).integers(0, 256, (72, 128, 3), dtype=np.uint8)
    maps = encoder.encode_dense([image])
    assert maps.shape[:2] == (1, 24) and maps.shape[3] > maps.shape[2]
    torch.testing.assert_close(maps.norm(dim=1), torch.ones_like(maps[:, 0]))
    half = OpenClipVitEncoder(
        _model({"timm_proj": "linear"} | vision),
        architecture="ViT-B-16", source="tiny", mean=(0.5,) * 3, std=(0.5,) * 3,
        config=VitConfig(precision="bfloat16"),
    )  # fmt: skip
    assert F.cosine_similarity(half.encode_dense([image]), maps).min() > 0.98


@torch.no_grad()
@pytest.mark.parametrize(
    "text", [{}, {"pool_type": "last", "no_causal_mask": True, "proj_bias": True}]
)
def test_text_of_custom_models_equals_open_clip(text: dict[str, Any]) -> None:
    model = _model(OPEN_VIT, **text)
    encoder = _encoder(model)
    ids: Tensor = encoder._tokenizer(["give me the pear"])
    features = encoder.encode_text("give me the pear")
    wanted = model.encode_text(ids, normalize=True)[0].numpy()
    np.testing.assert_allclose(features.pooled, wanted, atol=1e-6)
    assert features.tokens.shape[1] == encoder.feature_dim == 24
    assert 6 <= len(features.tokens) <= 7  # start, give, me, the, pear, end, perhaps one padding


@pytest.mark.parametrize(
    ("vision", "why"),
    [
        (OPEN_VIT | {"attentional_pool": True}, "its attentional pool mixes patches into many"),
        ({"image_size": 32, "layers": [1, 1, 1, 1], "width": 8}, "tower is a ModifiedResNet"),
        (
            {"timm_model_name": "tiny_vit_for_tests", "timm_pool": "max", "timm_proj": "linear"},
            "it pools by 'max', not by mean or attention",
        ),
        (
            {
                "timm_model_name": "tiny_convnext_for_tests",
                "timm_pool": "max",
                "timm_proj": "linear",
            },
            "it pools by 'max', not by the mean",
        ),
    ],
)
def test_towers_that_cannot_be_read(vision: dict[str, Any], why: str) -> None:
    with pytest.raises(UnsupportedEncoderError) as caught:
        _encoder(_model(vision))
    message = str(caught.value)
    assert message.startswith("ViT-B-16:tiny has no dense features here: ") and why in message
    assert message.endswith("and timm's convolutional towers that average.")
    assert "\n" not in message


def test_clip_class_is_read_like_the_custom_one() -> None:
    encoder = _encoder(_model(OPEN_VIT, CLIP))
    assert encoder.encode_text("pear").tokens.shape == (3, 24)


def test_missing_tokenizer_names_the_command(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path_factory.mktemp("hub")))
    from perception.encoders.open_clip_vit import _load_tokenizer

    with pytest.raises(MissingWeightsError) as caught:
        _load_tokenizer("ViT-B-16-SigLIP")
    message = str(caught.value)
    assert message.startswith("The tokenizer of ViT-B-16-SigLIP is not on this machine: no timm/")
    assert "hf download timm/ViT-B-16-SigLIP" in message and "\n" not in message
