"""Models of open_clip as dense encoders (section 3.2.1: multi-scale patch features)."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import open_clip
import torch
import torch.nn.functional as F
from huggingface_hub.constants import HF_HUB_CACHE
from open_clip.factory import load_state_dict
from open_clip.model import CLIP, CustomTextCLIP, resize_pos_embed
from safetensors import SafetensorError
from torch import Tensor, nn

from perception.encoders.base import (
    PRECISIONS,
    Precision,
    TextFeatures,
    checked_text,
    compute_dtype,
    stacked_images,
)
from perception.encoders.clip_weights import RGB, ClipWeights, is_torchscript
from perception.encoders.image_towers import image_tower
from perception.encoders.text_towers import text_tower
from perception.encoders.tiling import Window, blend, image_windows
from perception.errors import InvalidConfigError, InvalidWeightsError, MissingWeightsError


@dataclass(frozen=True, kw_only=True)
class VitConfig:
    """Settings of the dense encoding.

    Attributes:
        num_tiles: Tiles along each side of the image, besides the whole image; 0 = whole image
            only.
        tile_overlap: Share of a tile's length that its neighbour sees too, 0..0.9.
        precision: Arithmetic of the image tower; see `perception.encoders.base.compute_dtype`.
        batch_size: Images and tiles that go through the network together.
    """

    num_tiles: int = 2
    tile_overlap: float = 1 / 3
    precision: Precision = "auto"
    batch_size: int = 8

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.num_tiles < 0 or not 0 <= self.tile_overlap <= 0.9:
            raise InvalidConfigError(
                f"num_tiles is {self.num_tiles} and tile_overlap {self.tile_overlap}, expected 0 "
                "or more and 0..0.9."
            )
        if self.batch_size < 1:
            raise InvalidConfigError(f"batch_size is {self.batch_size}, expected 1 or more.")
        compute_dtype(self.precision)


class OpenClipVitEncoder:
    """A model of open_clip behind the `Encoder` protocol."""

    def __init__(
        self,
        model: CLIP | CustomTextCLIP,
        *,
        architecture: str,
        source: str,
        mean: RGB,
        std: RGB,
        config: VitConfig | None = None,
    ) -> None:
        """Wrap a loaded model.

        Args:
            model: An `open_clip.CLIP` or `CustomTextCLIP`.
            architecture: Name of its configuration in open_clip; chooses the tokenizer.
            source: Where its weights come from.
            mean: RGB mean for normalisation.
            std: RGB deviation for normalisation.
            config: Settings; the defaults if None.

        Raises:
            UnsupportedEncoderError: If one of the towers cannot be read token by token.
            MissingWeightsError: If the tokenizer is not on this machine.
        """
        self.config = config or VitConfig()
        self.name = f"{architecture}:{source}"
        self._model = model.eval().requires_grad_(False)
        self._dtype = compute_dtype(self.config.precision)
        self.fingerprints = tuple(
            _fingerprint(self.name, model, self.config, dtype) for dtype in PRECISIONS
        )
        self.fingerprint = self.fingerprints[PRECISIONS.index(self._dtype)]
        self._tower = image_tower(cast(nn.Module, model.visual).to(self._dtype), self.name)
        self._text_tower = text_tower(model, self.name)
        self._tokenizer = _load_tokenizer(architecture)
        self._mean = torch.tensor(mean).view(3, 1, 1) * 255.0
        self._std = torch.tensor(std).view(3, 1, 1) * 255.0
        self.feature_dim = self._text_tower.feature_dim

    @classmethod
    def from_weights(
        cls, weights: ClipWeights, config: VitConfig | None = None
    ) -> "OpenClipVitEncoder":
        """Build a model and load its weights.

        Args:
            weights: What to load.
            config: Settings; the defaults if None.

        Returns:
            The encoder.

        Raises:
            InvalidWeightsError: If the file does not fit the architecture.
        """
        # open_clip only warns where configuration and weights disagree about GELU.
        model = cast(
            CLIP | CustomTextCLIP,
            open_clip.create_model(
                weights.architecture,
                load_weights=False,
                force_quick_gelu=weights.is_quick_gelu,
            ),
        )
        try:
            model.load_state_dict(_read_state(weights, model))
        except (RuntimeError, OSError, SafetensorError, KeyError) as error:
            raise InvalidWeightsError(
                f"{weights.path} does not hold weights of {weights.architecture} "
                f"({str(error).splitlines()[0]}); check the file, or name its architecture."
            ) from error
        return cls(
            model,
            architecture=weights.architecture,
            source=weights.source,
            mean=weights.mean,
            std=weights.std,
            config=config,
        )

    @torch.no_grad()
    def encode_dense(self, images: Sequence[np.ndarray]) -> Tensor:
        """Encode images into feature maps in text space; see `Encoder.encode_dense`.

        Args:
            images: V images, each (H, W, 3) uint8 RGB, all of one size.

        Returns:
            (V, C, h, w) float32, each cell of unit length; h and w are the patches of all tiles
            together; a view with channels innermost.
        """
        pixels = torch.from_numpy(stacked_images(images)).permute(0, 3, 1, 2).float()
        pixels = (pixels - self._mean) / self._std
        windows = image_windows(self.config.num_tiles, self.config.tile_overlap)
        grid = self._patch_grid(*pixels.shape[-2:])
        inputs = torch.cat([self._network_input(pixels, window, grid) for window in windows])
        features = torch.cat(
            [self.value_features(part, grid) for part in inputs.split(self.config.batch_size)]
        )
        smallest = min(window.size for window in windows)
        size = round(grid[0] / smallest), round(grid[1] / smallest)
        maps = blend(features.unflatten(0, (len(windows), len(pixels))), windows, size)
        return F.normalize(maps, dim=-1).permute(0, 3, 1, 2)

    @torch.no_grad()
    def encode_text(self, text: str) -> TextFeatures:
        """Encode one text with the model's text tower; see `Encoder.encode_text`.

        Args:
            text: Any text with at least one word; beyond the tower's context (77 tokens in CLIP)
                it is cut.

        Returns:
            Its features; tokens reach from the start token to the end token, and are projected into
            the text space like the pooled one.

        Raises:
            InvalidTextError: If the text is empty.
        """
        return self._text_tower.read(self._tokenizer([checked_text(text)]))

    def value_features(self, pixels: Tensor, grid: tuple[int, int]) -> Tensor:
        """Compute patch features in text space; see `perception.encoders.image_towers`.

        Args:
            pixels: (B, 3, h * patch, w * patch) normalised pixels.
            grid: h and w, in patches; not necessarily those of the training.

        Returns:
            (B, h, w, C) float32, each cell of unit length.
        """
        features = self._tower.read(pixels.to(self._dtype), grid).float()
        return F.normalize(features, dim=-1).unflatten(1, grid)

    def _patch_grid(self, height: int, width: int) -> tuple[int, int]:
        """Return the patches of one pass: the trained number on the short side, aspect kept."""
        short = min(self._tower.grid_size)
        scale = short / min(height, width)
        return max(1, round(height * scale)), max(1, round(width * scale))

    def _network_input(self, pixels: Tensor, window: Window, grid: tuple[int, int]) -> Tensor:
        height, width = pixels.shape[-2:]
        top, left = round(window.top * height), round(window.left * width)
        bottom = round((window.top + window.size) * height)
        right = round((window.left + window.size) * width)
        patch_height, patch_width = self._tower.patch_size
        return F.interpolate(
            pixels[..., top:bottom, left:right],
            size=(grid[0] * patch_height, grid[1] * patch_width),
            mode="bicubic",
            antialias=True,
            align_corners=False,
        )


def _read_state(weights: ClipWeights, model: nn.Module) -> dict[str, Tensor]:
    if is_torchscript(weights.path):
        archive = cast(nn.Module, torch.jit.load(weights.path, map_location="cpu"))
        state: dict[str, Tensor] = dict(archive.state_dict())
        for name in ("input_resolution", "context_length", "vocab_size"):
            state.pop(name, None)
    else:
        state = cast(dict[str, Tensor], load_state_dict(str(weights.path)))
    resize_pos_embed(state, model)
    return {name: tensor.float() for name, tensor in state.items()}


def _load_tokenizer(architecture: str) -> Callable[[list[str]], Tensor]:
    # Tokenizers of the hub belong to the weights: nothing is fetched behind the user's back.
    repository = (open_clip.get_model_config(architecture) or {})["text_cfg"].get(
        "hf_tokenizer_name"
    )
    try:
        if repository is None:
            return open_clip.get_tokenizer(architecture)
        return open_clip.get_tokenizer(architecture, local_files_only=True)
    except (OSError, ValueError) as error:
        raise MissingWeightsError(
            f"The tokenizer of {architecture} is not on this machine: no {repository} in "
            f"{HF_HUB_CACHE}. Fetch it with `hf download {repository} --include '*token*' "
            "'*.json'`."
        ) from error


def _fingerprint(
    name: str, model: CLIP | CustomTextCLIP, config: VitConfig, dtype: torch.dtype
) -> str:
    tiling = (config.num_tiles, config.tile_overlap)
    digest = hashlib.sha256(f"{name}|{tiling}|{dtype}".encode())
    # The first and last weights stand for all: hashing a gigabyte would take seconds.
    weights = list(cast(nn.Module, model.visual).parameters())
    for tensor in (weights[0], weights[-1]):
        digest.update(tensor.detach().float().numpy().tobytes())
    return f"{name}-{digest.hexdigest()[:16]}"
