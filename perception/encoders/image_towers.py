"""Image towers of open_clip, read densely: one vector in text space for each patch.

How a tower pools its patches decides how a single patch is read:

- by a class token: value path of the last attention block (MaskCLIP, Zhou et al. 2022), value and
  output projection without the mixing over patches;
- by attention from a learnt query (SigLIP): value path of that attention, which is what the tower
  would say if the query looked at this patch alone;
- by the mean: the patches themselves. A norm behind the mean is applied to all of them with the
  statistics of their mean, so that the mean of the map is the tower's own embedding.
"""

from collections.abc import Callable
from typing import Any, Protocol, cast

import torch
import torch.nn.functional as F
from open_clip.timm_model import TimmModel
from open_clip.transformer import ResidualAttentionBlock, VisionTransformer
from timm.layers import AttentionPoolLatent, ClassifierHead, NormMlpClassifierHead, PatchEmbed
from timm.layers.pos_embed import resample_abs_pos_embed
from timm.models.vision_transformer import Attention, Block
from timm.models.vision_transformer import VisionTransformer as TimmViT
from torch import Tensor, nn

from perception.errors import UnsupportedEncoderError

Read = Callable[[Tensor], Tensor]


class ImageTower(Protocol):
    """A tower that was found fit for dense reading."""

    patch_size: tuple[int, int]
    grid_size: tuple[int, int]

    def read(self, pixels: Tensor, grid: tuple[int, int]) -> Tensor:
        """Read every patch.

        Args:
            pixels: (B, 3, h * patch, w * patch) normalised pixels of the tower's type.
            grid: h and w, in patches; not necessarily those of the training.

        Returns:
            (B, h * w, C) in text space, not normalised.
        """
        ...


def image_tower(visual: nn.Module, name: str) -> ImageTower:
    """Find out how a tower is to be read.

    Args:
        visual: Image tower of an open_clip model, in evaluation mode.
        name: Name of the model, for messages.

    Returns:
        The tower.

    Raises:
        UnsupportedEncoderError: If its patches cannot be read one by one.
    """
    if isinstance(visual, VisionTransformer):
        return _ClipVit(visual, name)
    if isinstance(visual, TimmModel):
        return (_TimmVit if isinstance(visual.trunk, TimmViT) else _TimmConv)(visual, name)
    raise _unsupported(name, f"its image tower is a {type(visual).__name__}")


class _ClipVit:
    """Vision transformer of open_clip."""

    def __init__(self, visual: VisionTransformer, name: str) -> None:
        if visual.attn_pool is not None:
            raise _unsupported(name, "its attentional pool mixes patches into many queries (CoCa)")
        if visual.pool_type == "none":
            raise _unsupported(name, "it has no pooling, hence no embedding to compare with")
        self.patch_size = cast(tuple[int, int], visual.patch_size)
        self.grid_size = cast(tuple[int, int], visual.grid_size)
        self._visual, self._is_mean = visual, visual.pool_type == "avg"
        self._blocks = list(visual.transformer.resblocks)
        if not self._is_mean and not isinstance(self._blocks[-1], ResidualAttentionBlock):
            raise _unsupported(name, f"its last block is a {type(self._blocks[-1]).__name__}")

    def read(self, pixels: Tensor, grid: tuple[int, int]) -> Tensor:
        visual = self._visual
        x = visual.conv1(pixels).flatten(2).transpose(1, 2)
        token = visual.class_embedding.expand(len(x), 1, -1)
        x = torch.cat([token, x], dim=1) + self._position_embedding(grid)
        x = visual.get_submodule("ln_pre")(x)
        for block in self._blocks[:-1]:
            x = block(x)
        x = self._blocks[-1](x)[:, 1:] if self._is_mean else self._values(x[:, 1:])
        if self._is_mean and visual.final_ln_after_pool:
            x = _norm_of_mean(visual.ln_post, x)
        else:
            x = visual.ln_post(x)
        return x @ cast(Tensor, visual.proj)

    def _values(self, x: Tensor) -> Tensor:
        last = cast(ResidualAttentionBlock, self._blocks[-1])
        x = last.ln_1(x)
        # MultiheadAttention stacks the input projections of queries, keys and values.
        weight, bias = last.attn.in_proj_weight.chunk(3)[2], last.attn.in_proj_bias.chunk(3)[2]
        return last.attn.out_proj(F.linear(x, weight, bias))

    def _position_embedding(self, grid: tuple[int, int]) -> Tensor:
        embedding = self._visual.positional_embedding
        if grid == tuple(self.grid_size):
            return embedding
        patches = embedding[1:].float().T.reshape(1, -1, *self.grid_size)
        resized = F.interpolate(
            patches, size=grid, mode="bicubic", antialias=True, align_corners=False
        )
        return torch.cat([embedding[:1], resized.flatten(2)[0].T.to(embedding.dtype)])


class _TimmVit:
    """Vision transformer of timm, such as SigLIP's."""

    def __init__(self, visual: TimmModel, name: str) -> None:
        trunk = cast(TimmViT, visual.trunk)
        embed = trunk.patch_embed
        if not isinstance(embed, PatchEmbed) or trunk.pos_embed is None:
            raise _unsupported(name, "its patches do not come from one convolution")
        self.patch_size = cast(tuple[int, int], embed.patch_size)
        self.grid_size = cast(tuple[int, int], embed.grid_size)
        self._trunk, self._head = trunk, visual.head
        self._read_patches = self._choose(trunk, name)

    def _choose(self, trunk: TimmViT, name: str) -> Read:
        pool, last = trunk.attn_pool, trunk.blocks[-1]
        if isinstance(pool, AttentionPoolLatent):
            if pool.pos_embed is not None or pool.latent_len != 1 or trunk.pool_include_prefix:
                raise _unsupported(name, "its attention pool has several queries or positions")
            return self._pool_values
        if pool is not None:
            raise _unsupported(name, f"its attention pool is a {type(pool).__name__}")
        if trunk.global_pool == "avg" and not trunk.pool_include_prefix:
            return self._mean_parts
        if trunk.global_pool != "token":
            raise _unsupported(name, f"it pools by {trunk.global_pool!r}, not by mean or attention")
        if not isinstance(last, Block) or not isinstance(last.attn, Attention):
            raise _unsupported(name, f"its last block is a {type(last).__name__}")
        return self._block_values

    def read(self, pixels: Tensor, grid: tuple[int, int]) -> Tensor:
        trunk = self._trunk
        x = trunk.norm_pre(self._embed(pixels, grid))
        for block in trunk.blocks[:-1]:
            x = block(x)
        return self._head(trunk.head(self._read_patches(x)))

    def _embed(self, pixels: Tensor, grid: tuple[int, int]) -> Tensor:
        trunk = self._trunk
        embed = cast(PatchEmbed, trunk.patch_embed)
        x = embed.norm(embed.proj(pixels).flatten(2).transpose(1, 2))
        num_prefix = 0 if trunk.no_embed_class else trunk.num_prefix_tokens
        positions = resample_abs_pos_embed(
            cast(Tensor, trunk.pos_embed),
            list(grid),
            list(self.grid_size),
            num_prefix_tokens=num_prefix,
        )
        tokens = [
            t.expand(len(x), -1, -1) for t in (trunk.cls_token, trunk.reg_token) if t is not None
        ]
        if trunk.no_embed_class:
            return torch.cat([*tokens, x + positions], dim=1)
        return torch.cat([*tokens, x], dim=1) + positions

    def _patches(self, x: Tensor) -> Tensor:
        return x[:, self._trunk.num_prefix_tokens :]

    def _pool_values(self, x: Tensor) -> Tensor:
        trunk = self._trunk
        pool = cast(AttentionPoolLatent, trunk.attn_pool)
        x = trunk.norm(self._patches(trunk.blocks[-1](x)))
        x = pool.proj(_last_part(pool.kv, 2, x))
        if pool.mlp is not None:
            x = x + pool.mlp(pool.norm(x))
        return trunk.fc_norm(x)

    def _block_values(self, x: Tensor) -> Tensor:
        trunk, last = self._trunk, cast(Block, self._trunk.blocks[-1])
        attention = cast(Attention, last.attn)
        weight, bias = attention.qkv.weight.chunk(3)[2], attention.qkv.bias
        x = F.linear(
            last.norm1(self._patches(x)), weight, None if bias is None else bias.chunk(3)[2]
        )
        x = last.ls1(attention.proj(attention.norm(x)))
        return trunk.fc_norm(trunk.norm(x))

    def _mean_parts(self, x: Tensor) -> Tensor:
        trunk = self._trunk
        return _norm_of_mean(trunk.fc_norm, self._patches(trunk.norm(trunk.blocks[-1](x))))


class _TimmConv:
    """Convolutional tower of timm that averages its last feature map."""

    def __init__(self, visual: TimmModel, name: str) -> None:
        trunk, head = visual.trunk, getattr(visual.trunk, "head", None)
        if "pool" in dict(visual.head.named_children()):
            raise _unsupported(name, "its attention pool needs a map of the trained size")
        if not isinstance(head, ClassifierHead | NormMlpClassifierHead):
            raise _unsupported(name, f"its image tower is a {type(trunk).__name__} of timm")
        if getattr(head, "input_fmt", "NCHW") != "NCHW":
            raise _unsupported(name, f"its image tower is a {type(trunk).__name__} of timm")
        if not str(head.global_pool.pool_type).endswith("avg"):
            raise _unsupported(name, f"it pools by {head.global_pool.pool_type!r}, not by the mean")
        self._trunk, self._norm = cast(Any, trunk), getattr(head, "norm", nn.Identity())
        self._rest = nn.Sequential(getattr(head, "pre_logits", nn.Identity()), head.fc, visual.head)
        height, width = cast(tuple[int, int], visual.image_size)
        weight = next(trunk.parameters())
        with torch.no_grad():
            probe = self._trunk.forward_features(weight.new_zeros(1, 3, height, width))
        self.grid_size = (probe.shape[2], probe.shape[3])
        self.patch_size = (height // probe.shape[2], width // probe.shape[3])

    def read(self, pixels: Tensor, grid: tuple[int, int]) -> Tensor:
        x = self._trunk.forward_features(pixels)
        x = F.interpolate(x, size=grid) if x.shape[2:] != grid else x
        return self._rest(_norm_of_mean(self._norm, x.flatten(2).transpose(1, 2)))


def _last_part(linear: nn.Linear, num_parts: int, x: Tensor) -> Tensor:
    """Apply the last of several projections that are stacked in one layer: that of the values."""
    bias = None if linear.bias is None else linear.bias.chunk(num_parts)[-1]
    return F.linear(x, linear.weight.chunk(num_parts)[-1], bias)


def _norm_of_mean(norm: nn.Module, x: Tensor) -> Tensor:
    """Apply a layer norm to (B, N, C) vectors as their mean would be: an affine map."""
    if not isinstance(norm, nn.LayerNorm):
        return norm(x)
    mean = x.mean(dim=1, keepdim=True).float()
    variance, center = torch.var_mean(mean, dim=-1, correction=0, keepdim=True)
    scaled = ((x.float() - center) * torch.rsqrt(variance + norm.eps)).to(x.dtype)
    scaled = scaled if norm.weight is None else scaled * norm.weight
    return scaled if norm.bias is None else scaled + norm.bias


def _unsupported(name: str, why: str) -> UnsupportedEncoderError:
    return UnsupportedEncoderError(
        f"{name} has no dense features here: {why}. Supported: vision transformers that pool by "
        "class token, mean or one attention query, and timm's convolutional towers that average."
    )
