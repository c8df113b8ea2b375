"""The encoder that ships with the package: no download, no training, about 55 MB.

Image tower: EfficientNet-Lite0 (ImageNet weights). Text tower: all-MiniLM-L6-v2. Both are built by
open_clip as one custom model. They were never trained together; `ClassMixtureHead` aligns them
through the names of the ImageNet classes. It is a stand-in for CLIP where CLIP's weights are not at
hand: it knows what ImageNet knows, and little of colours.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np
import torch
import torch.nn.functional as F
from open_clip.hf_model import HFTextEncoder
from open_clip.model import CustomTextCLIP
from safetensors.torch import load_file
from timm.models import EfficientNet
from tokenizers import Tokenizer
from torch import Tensor

from perception.encoders.base import TextFeatures, checked_text, stacked_images
from perception.encoders.class_mixture import ClassMixtureHead
from perception.encoders.efficientnet import TRUNK_NAME, fold_batch_norm, to_network_input
from perception.errors import InvalidConfigError, InvalidWeightsError, MissingWeightsError

WEIGHTS_DIR = Path(__file__).resolve().parents[1] / "weights" / "embedded"
IMAGE_WEIGHTS = "image.safetensors"
TEXT_WEIGHTS = "text.safetensors"
TOKENIZER = "tokenizer.json"
TEXT_CONFIG = "config.json"
WEIGHT_FILES = (IMAGE_WEIGHTS, TEXT_WEIGHTS, TOKENIZER, TEXT_CONFIG)

TEXT_DIM = 384
NUM_IMAGE_FEATURES = 1280
NUM_CLASSES = 1000
MAX_TOKENS = 256  # the length that all-MiniLM-L6-v2 was trained for

Precision = Literal["auto", "float32", "bfloat16"]


@dataclass(frozen=True, kw_only=True)
class EmbeddedEncoderConfig:
    """Settings of the embedded encoder.

    Attributes:
        long_side: Length in pixels to which an image's longer side is resized, a multiple of 32.
        temperature: Softening of the class probabilities.
        precision: Arithmetic of the image tower. `auto` takes bfloat16 where the CPU multiplies it
            natively (AMX, AVX512-BF16) and float32 elsewhere; features then differ slightly
            between machines.
    """

    long_side: int = 960
    temperature: float = 2.0
    precision: Precision = "auto"

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.long_side <= 0 or self.long_side % 32:
            raise InvalidConfigError(
                f"long_side is {self.long_side}, expected a positive multiple of 32."
            )
        if not self.temperature > 0:
            raise InvalidConfigError(
                f"temperature is {self.temperature}, expected a positive number."
            )
        if self.precision not in get_args(Precision):
            names = ", ".join(get_args(Precision))
            raise InvalidConfigError(f"Unknown precision {self.precision!r}. Precisions: {names}.")

    def dtype(self) -> torch.dtype:
        """Return the type in which the image tower computes on this machine."""
        if self.precision == "auto":
            return torch.bfloat16 if _has_native_bfloat16() else torch.float32
        return torch.bfloat16 if self.precision == "bfloat16" else torch.float32


class EmbeddedEncoder:
    """EfficientNet-Lite0 and MiniLM behind the `Encoder` protocol.

    Loading reads local files only; nothing here can reach a network.
    """

    name = "embedded"
    feature_dim = TEXT_DIM

    def __init__(
        self, config: EmbeddedEncoderConfig | None = None, weights_dir: Path = WEIGHTS_DIR
    ) -> None:
        """Load the weights.

        Args:
            config: Settings; the defaults if None.
            weights_dir: Folder that holds `WEIGHT_FILES`.

        Raises:
            MissingWeightsError: If a weight file is not there.
            InvalidWeightsError: If a weight file belongs to another model.
        """
        self.config = config or EmbeddedEncoderConfig()
        _require_files(weights_dir)
        self._dtype = self.config.dtype()
        self._tokenizer = Tokenizer.from_file(str(weights_dir / TOKENIZER))
        self._tokenizer.no_padding()
        self._tokenizer.enable_truncation(MAX_TOKENS)
        model = build_open_clip_model(weights_dir)
        self.head = ClassMixtureHead(
            num_features=NUM_IMAGE_FEATURES, num_classes=NUM_CLASSES, text_dim=TEXT_DIM
        )
        _load_weights(model, self.head, weights_dir)
        model.requires_grad_(False)
        self.head.requires_grad_(False)
        self._text_tower = cast(HFTextEncoder, model.text)
        trunk = fold_batch_norm(cast(EfficientNet, model.get_submodule("visual.trunk")))
        self._trunk = trunk.to(self._dtype).to(memory_format=torch.channels_last)
        self.fingerprint = _fingerprint(weights_dir, self.config, self._dtype)

    def network_size(self, height: int, width: int) -> tuple[int, int]:
        """Return the size to which an image is resized: aspect ratio kept to the next 32 pixels.

        Args:
            height: Height of the image.
            width: Width of the image.

        Returns:
            Height and width in pixels, multiples of 32.
        """
        scale = self.config.long_side / max(height, width)
        return max(32, round(height * scale / 32) * 32), max(32, round(width * scale / 32) * 32)

    @torch.no_grad()
    def encode_trunk(self, images: Sequence[np.ndarray]) -> Tensor:
        """Encode images up to the classifier.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, h, w, 1280) features before the classifier, in the tower's type.
        """
        batch = torch.from_numpy(stacked_images(images)).permute(0, 3, 1, 2)
        pixels = to_network_input(batch, self.network_size(*batch.shape[-2:]))
        pixels = pixels.to(dtype=self._dtype, memory_format=torch.channels_last)
        return self._trunk.forward_features(pixels).permute(0, 2, 3, 1)

    @torch.no_grad()
    def encode_dense(self, images: Sequence[np.ndarray]) -> Tensor:
        """Encode images into feature maps in text space; see `Encoder.encode_dense`.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, 384, h, w) float32, each cell of unit length; a view with channels innermost.
        """
        features = self.head(self.encode_trunk(images), self.config.temperature)
        return features.permute(0, 3, 1, 2)

    @torch.no_grad()
    def encode_text(self, text: str) -> TextFeatures:
        """Encode one text with MiniLM; see `Encoder.encode_text`.

        Args:
            text: Any text with at least one word; beyond 256 tokens it is cut.

        Returns:
            Its features; the tokens include the start and end tokens.

        Raises:
            InvalidTextError: If the text is empty.
        """
        ids = torch.tensor([self._tokenizer.encode(checked_text(text)).ids])
        pooled, tokens = self._text_tower(ids)
        return TextFeatures(pooled=F.normalize(pooled, dim=-1)[0].numpy(), tokens=tokens[0].numpy())


def build_open_clip_model(text_config_dir: Path) -> CustomTextCLIP:
    """Build the two towers as an open_clip model with random weights.

    Args:
        text_config_dir: Folder with the `config.json` of the text tower.

    Returns:
        The model, in evaluation mode.
    """
    vision_cfg = {"timm_model_name": TRUNK_NAME, "timm_pool": "avg", "timm_proj": "none"}
    text_cfg = {
        # An absolute folder: a relative one would be taken for a name on the hub.
        "hf_model_name": str(text_config_dir.resolve()),
        "hf_model_pretrained": False,
        "hf_proj_type": None,  # open_clip's default would add an untrained MLP
        "hf_pooler_type": "mean_pooler",
        "output_tokens": True,
    }
    return CustomTextCLIP(TEXT_DIM, vision_cfg, text_cfg).eval()  # pyright: ignore[reportArgumentType]


def _has_native_bfloat16() -> bool:
    return bool(torch.cpu._is_amx_tile_supported() or torch.cpu._is_avx512_bf16_supported())


def _require_files(weights_dir: Path) -> None:
    missing = [name for name in WEIGHT_FILES if not (weights_dir / name).is_file()]
    if missing:
        raise MissingWeightsError(
            f"The embedded encoder misses {', '.join(missing)} in {weights_dir}; expected "
            f"{', '.join(WEIGHT_FILES)}. Reinstall the package, or make them with "
            "`python tools/convert_embedded_weights.py`."
        )


def _load_weights(model: CustomTextCLIP, head: ClassMixtureHead, weights_dir: Path) -> None:
    image = {
        name: tensor.float() for name, tensor in load_file(weights_dir / IMAGE_WEIGHTS).items()
    }
    text = {name: tensor.float() for name, tensor in load_file(weights_dir / TEXT_WEIGHTS).items()}
    parts = (
        (model.get_submodule("visual.trunk"), "trunk.", image, IMAGE_WEIGHTS),
        (head, "head.", image, IMAGE_WEIGHTS),
        (model.get_submodule("text.transformer"), "", text, TEXT_WEIGHTS),
    )
    for module, prefix, tensors, file in parts:
        state = {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}
        try:
            module.load_state_dict(state, strict=True, assign=True)
        except RuntimeError as error:
            raise InvalidWeightsError(
                f"{weights_dir / file} does not fit {type(module).__name__}: expected the tensors "
                "that `python tools/convert_embedded_weights.py` writes. Run it again."
            ) from error


def _fingerprint(weights_dir: Path, config: EmbeddedEncoderConfig, dtype: torch.dtype) -> str:
    digest = hashlib.sha256(f"{config.long_side}|{config.temperature}|{dtype}".encode())
    digest.update((weights_dir / IMAGE_WEIGHTS).read_bytes())
    return f"embedded-{digest.hexdigest()[:16]}"
