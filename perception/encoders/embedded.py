"""The encoder that ships with the package: no download, no training, about 55 MB.

Image tower: EfficientNet-Lite0 (ImageNet weights). Text tower: all-MiniLM-L6-v2. Both are built by
open_clip as one custom model, and both stay as they were; `GroundingHead` between them was trained
on rendered household objects (weights/embedded/MODEL_CARD.md). It is a stand-in for CLIP where
CLIP's weights are not at hand: it knows names, colours and uses of tabletop objects, and beyond
them what the names of the ImageNet classes say.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import torch
import torch.nn.functional as F
from open_clip.hf_model import HFTextEncoder
from open_clip.model import CustomTextCLIP
from safetensors.torch import load_file
from timm.models import EfficientNet
from tokenizers import Tokenizer
from torch import Tensor, nn

from perception.encoders.base import (
    PRECISIONS,
    Precision,
    TextFeatures,
    checked_text,
    compute_dtype,
    stacked_images,
)
from perception.encoders.efficientnet import (
    NUM_FINAL_FEATURES,
    TRUNK_NAME,
    cell_features,
    fold_batch_norm,
    pad_within_convolutions,
    to_network_input,
)
from perception.encoders.head import GroundingHead
from perception.errors import InvalidConfigError, InvalidWeightsError, MissingWeightsError

WEIGHTS_DIR = Path(__file__).resolve().parents[1] / "weights" / "embedded"
IMAGE_WEIGHTS = "image.safetensors"
HEAD_WEIGHTS = "head.safetensors"
TUNED = "tower."
"""Prefix, in the head's file, of the weights of the image tower that were trained with it."""
TEXT_WEIGHTS = "text.safetensors"
TOKENIZER = "tokenizer.json"
TEXT_CONFIG = "config.json"
WEIGHT_FILES = (IMAGE_WEIGHTS, HEAD_WEIGHTS, TEXT_WEIGHTS, TOKENIZER, TEXT_CONFIG)

TEXT_DIM = 384
NUM_CLASSES = 1000
_TEXTS_PER_BATCH = 256
MAX_TOKENS = 256  # the length that all-MiniLM-L6-v2 was trained for


@dataclass(frozen=True, kw_only=True)
class EmbeddedEncoderConfig:
    """Settings of the embedded encoder.

    Attributes:
        long_side: Length in pixels to which an image's longer side is resized, a multiple of 32.
        temperature: Softening of the class probabilities.
        mixture_share: Weight of the class-name mixture beside the trained projection, in 0..1; 1 is
            the mixture alone, on the tower as it was before any training. None takes the weight
            stored with the head.
        precision: Arithmetic of the image tower. `auto` takes bfloat16 where the CPU multiplies it
            natively (AMX, AVX512-BF16) and float32 elsewhere; features then differ slightly
            between machines.
    """

    long_side: int = 960
    temperature: float = 2.0
    mixture_share: float | None = None
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
        if self.mixture_share is not None and not 0 <= self.mixture_share <= 1:
            raise InvalidConfigError(
                f"mixture_share is {self.mixture_share}, expected a number in 0..1 or None."
            )
        compute_dtype(self.precision)

    def dtype(self) -> torch.dtype:
        """Return the type in which the image tower computes on this machine."""
        return compute_dtype(self.precision)


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
        self.head = GroundingHead(num_classes=NUM_CLASSES, text_dim=TEXT_DIM)
        tuned = _load_weights(model, self.head, weights_dir)
        model.requires_grad_(False)
        self.head.requires_grad_(False)
        if self.config.mixture_share is not None:
            self.head.mixture_share.fill_(self.config.mixture_share)
        self._text_tower = cast(HFTextEncoder, model.text)
        trunk = cast(EfficientNet, model.get_submodule("visual.trunk"))
        trunk = pad_within_convolutions(fold_batch_norm(trunk))
        if self.config.mixture_share != 1:
            _tune(trunk, tuned, weights_dir)
        self._trunk = trunk.to(self._dtype).to(memory_format=torch.channels_last)
        self._weights_dir = weights_dir
        self.fingerprint = _fingerprint(weights_dir, self.config, self._dtype)

    @property
    def fingerprints(self) -> tuple[str, ...]:
        """Fingerprints of the same encoder in every arithmetic."""
        return tuple(_fingerprint(self._weights_dir, self.config, dtype) for dtype in PRECISIONS)

    @property
    def trunk(self) -> EfficientNet:
        """The image tower up to the classifier, batch norm folded, in the tower's type."""
        return self._trunk

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
        return self.encode_cells(images)[..., :NUM_FINAL_FEATURES]

    @torch.no_grad()
    def encode_cells(self, images: Sequence[np.ndarray]) -> Tensor:
        """Encode images into what the head reads.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, h, w, NUM_CELL_FEATURES); see `perception.encoders.efficientnet.cell_features`.
        """
        batch = torch.from_numpy(stacked_images(images)).permute(0, 3, 1, 2)
        pixels = to_network_input(batch, self.network_size(*batch.shape[-2:]), self._dtype)
        return cell_features(self._trunk, pixels)

    @torch.no_grad()
    def encode_dense(self, images: Sequence[np.ndarray]) -> Tensor:
        """Encode images into feature maps in text space; see `Encoder.encode_dense`.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, 384, h, w) float32, each cell of unit length; a view with channels innermost.
        """
        return self.describe_cells(self.encode_cells(images)).permute(0, 3, 1, 2)

    @torch.no_grad()
    def describe_cells(self, cells: Tensor) -> Tensor:
        """Turn cells into features in text space; see `CellEncoder.describe_cells`.

        Args:
            cells: (..., NUM_CELL_FEATURES) of `encode_cells`.

        Returns:
            (..., 384) float32, unit length.
        """
        return self.head(cells, self.config.temperature)

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

    @torch.no_grad()
    def encode_texts(self, texts: Sequence[str]) -> np.ndarray:
        """Encode many texts, those of one length together.

        Args:
            texts: N texts with at least one word each.

        Returns:
            (N, 384) float32 pooled features, unit rows.

        Raises:
            InvalidTextError: If one is empty.
        """
        ids = [self._tokenizer.encode(checked_text(text)).ids for text in texts]
        lengths = np.array([len(row) for row in ids])
        pooled = np.empty((len(texts), TEXT_DIM), np.float32)
        for length in np.unique(lengths):
            rows = np.flatnonzero(lengths == length)
            for part in np.array_split(rows, -(-len(rows) // _TEXTS_PER_BATCH)):
                batch = torch.tensor([ids[row] for row in part])
                pooled[part] = F.normalize(self._text_tower(batch)[0], dim=-1).numpy()
        return pooled


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


def _require_files(weights_dir: Path) -> None:
    missing = [name for name in WEIGHT_FILES if not (weights_dir / name).is_file()]
    if missing:
        raise MissingWeightsError(
            f"The embedded encoder misses {', '.join(missing)} in {weights_dir}; expected "
            f"{', '.join(WEIGHT_FILES)}. Reinstall the package, or make them with "
            "`python -m tools.convert_embedded_weights` and `python -m "
            "tools.train_embedded_encoder export`."
        )


def _load_weights(
    model: CustomTextCLIP, head: GroundingHead, weights_dir: Path
) -> dict[str, Tensor]:
    """Load towers and head; return the weights of the image tower that were trained."""
    convert = "python -m tools.convert_embedded_weights"
    export = "python -m tools.train_embedded_encoder export"
    trained = nn.ModuleDict({"hidden": head.hidden, "projection": head.projection})
    parts = (
        (model.get_submodule("visual.trunk"), "trunk.", IMAGE_WEIGHTS, convert),
        (head.mixture, "head.", IMAGE_WEIGHTS, convert),
        (trained, "trained.", HEAD_WEIGHTS, export),
        (model.get_submodule("text.transformer"), "", TEXT_WEIGHTS, convert),
    )
    files = {name: _load_floats(weights_dir / name) for name in {part[2] for part in parts}}
    for module, prefix, file, command in parts:
        tensors = files[file]
        state = {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}
        try:
            module.load_state_dict(state, strict=True, assign=True)
        except RuntimeError as error:
            raise _wrong_weights(weights_dir / file, type(module).__name__, command) from error
    share = files[HEAD_WEIGHTS].get("mixture_share")
    if share is None:
        raise _wrong_weights(weights_dir / HEAD_WEIGHTS, type(head).__name__, export)
    head.mixture_share = share
    return {k.removeprefix(TUNED): v for k, v in files[HEAD_WEIGHTS].items() if k.startswith(TUNED)}


def _tune(trunk: EfficientNet, tuned: dict[str, Tensor], weights_dir: Path) -> None:
    """Replace weights of the folded tower, in place, by those that were trained with the head."""
    state = trunk.state_dict()
    if any(name not in state or state[name].shape != w.shape for name, w in tuned.items()):
        export = "python -m tools.train_embedded_encoder export"
        raise _wrong_weights(weights_dir / HEAD_WEIGHTS, type(trunk).__name__, export)
    trunk.load_state_dict(tuned, strict=False)


def _load_floats(file: Path) -> dict[str, Tensor]:
    return {name: tensor.float() for name, tensor in load_file(file).items()}


def _wrong_weights(file: Path, module: str, command: str) -> InvalidWeightsError:
    return InvalidWeightsError(
        f"{file} does not fit {module}: expected the tensors that `{command}` writes. Run it again."
    )


def _fingerprint(weights_dir: Path, config: EmbeddedEncoderConfig, dtype: torch.dtype) -> str:
    settings = (config.long_side, config.temperature, config.mixture_share, dtype)
    digest = hashlib.sha256("|".join(map(str, settings)).encode())
    for name in (IMAGE_WEIGHTS, HEAD_WEIGHTS):
        digest.update((weights_dir / name).read_bytes())
    return f"embedded-{digest.hexdigest()[:16]}"
