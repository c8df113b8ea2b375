"""EfficientNet-Lite0 as a dense feature extractor: output stride 16, folded batch norm.

open_clip builds the image tower through timm by name and cannot pass an output stride, therefore
the wrapper `perception_efficientnet_lite0` is registered with timm here.
"""

from typing import Any, cast

import timm
import torch
import torch.nn.functional as F
from timm.layers import BatchNormAct2d, Conv2dSame
from timm.models import EfficientNet, register_model
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

TRUNK_NAME = "perception_efficientnet_lite0"
OUTPUT_STRIDE = 16

# Stages with output strides 8 and 16, and the edge of the squares of a cell's mean colours.
_SURFACE_STAGE, _PART_STAGE, _COLOR_PX = 2, 4, 4
NUM_FINAL_FEATURES, NUM_PART_FEATURES = 1280, 112
NUM_CELL_FEATURES = (
    NUM_FINAL_FEATURES + NUM_PART_FEATURES + 40 + 3 * (OUTPUT_STRIDE // _COLOR_PX) ** 2
)

# With these weights and output stride 16, a cell looks about 6 pixels to the left of its middle,
# and above it: TensorFlow's "same" padding centres output j of a stride-2 convolution on input
# 2j + 1, and the trained kernels lean the other way, also in the stage whose stride is removed
# here. Found by comparing the maps of pictures with those of their mirror images.
_ALIGNMENT_PX = 6

# Where a block of timm's EfficientNet keeps each convolution and the batch norm behind it.
_CONV_BN_PAIRS = {
    "DepthwiseSeparableConv": (("conv_dw", "bn1"), ("conv_pw", "bn2")),
    "InvertedResidual": (("conv_pw", "bn1"), ("conv_dw", "bn2"), ("conv_pwl", "bn3")),
    "EfficientNet": (("conv_stem", "bn1"), ("conv_head", "bn2")),
}


@register_model
def perception_efficientnet_lite0(pretrained: bool = False, **kwargs: Any) -> nn.Module:
    """Create timm's `tf_efficientnet_lite0` with output stride 16 instead of 32.

    The weights stay the same: the last stage keeps its resolution and dilates its kernels.

    Args:
        pretrained: Ignored; weights are always loaded from a file.
        **kwargs: Passed to timm.

    Returns:
        The network, randomly initialised.
    """
    del pretrained
    return timm.create_model(
        "tf_efficientnet_lite0", pretrained=False, output_stride=OUTPUT_STRIDE, **kwargs
    )


def fold_batch_norm(trunk: EfficientNet) -> EfficientNet:
    """Fold every batch norm into the convolution before it, in place; the function is unchanged.

    Args:
        trunk: An EfficientNet of timm in evaluation mode.

    Returns:
        The same network, whose batch norms have become their activations.
    """
    for module in list(trunk.modules()):
        for conv_name, norm_name in _CONV_BN_PAIRS.get(type(module).__name__, ()):
            conv, norm = module.get_submodule(conv_name), module.get_submodule(norm_name)
            assert isinstance(conv, nn.Conv2d) and isinstance(norm, BatchNormAct2d)
            plain = nn.BatchNorm2d(conv.out_channels, eps=cast(float, norm.eps)).eval()
            plain.load_state_dict(norm.state_dict())
            setattr(module, conv_name, fuse_conv_bn_eval(conv, plain))
            setattr(module, norm_name, norm.act)
    return trunk


def pad_within_convolutions(trunk: EfficientNet) -> EfficientNet:
    """Replace TensorFlow's "same" padding by padding that convolutions do themselves, in place.

    TensorFlow pads a stride-2 convolution by one more at the end than at the beginning, for which
    timm copies the whole input. A kernel with one more row and column of zeros in front, padded
    evenly, computes the same from the input as it is.

    Args:
        trunk: An EfficientNet of timm; its inputs have sides that are multiples of 32.

    Returns:
        The same network.
    """
    for name, module in list(trunk.named_modules()):
        if not isinstance(module, Conv2dSame):
            continue
        same = cast(nn.Conv2d, module)
        size = same.kernel_size[0]
        even = nn.Conv2d(
            same.in_channels,
            same.out_channels,
            size + 1,
            stride=same.stride[0],
            padding=(size - 1) // 2,
            groups=same.groups,
        )
        even.weight = nn.Parameter(F.pad(same.weight, (1, 0, 1, 0)), requires_grad=False)
        even.bias = same.bias
        parent, _, attribute = name.rpartition(".")
        setattr(trunk.get_submodule(parent), attribute, even)
    return trunk


def cell_features(trunk: EfficientNet, pixels: Tensor) -> Tensor:
    """Describe every cell of 16 x 16 pixels: what is there, what it is made of, its colours.

    The last stage of a network trained to name things has given up much of their colour and
    surface; therefore two earlier stages and the pixels themselves are kept beside it.

    Args:
        trunk: The network, folded or not, in evaluation mode.
        pixels: (V, 3, H, W) from `to_network_input`, in the network's type.

    Returns:
        (V, H / 16, W / 16, NUM_CELL_FEATURES) in the network's type: the 1280 features before the
        classifier first.
    """
    num_images, _, height, width = pixels.shape
    size = (height // OUTPUT_STRIDE, width // OUTPUT_STRIDE)
    cells = torch.empty(num_images, *size, NUM_CELL_FEATURES, dtype=pixels.dtype)
    # One image at a time: what lies between two layers stays in the processor's cache.
    for image, target in zip(pixels.split(1), cells, strict=True):
        parts = _cell_parts(trunk, image)
        widths = [part.shape[1] for part in parts]
        for part, place in zip(parts, target.split(widths, dim=-1), strict=True):
            place.copy_(part[0].permute(1, 2, 0))
    return cells


def _cell_parts(trunk: EfficientNet, pixels: Tensor) -> list[Tensor]:
    """Return what `cell_features` joins, each (1, channels, h, w)."""
    x = trunk.bn1(trunk.conv_stem(pixels))
    early = {}
    for index, stage in enumerate(trunk.blocks):
        x = stage(x)
        early[index] = x
    final = trunk.bn2(trunk.conv_head(x))
    surface = F.avg_pool2d(early[_SURFACE_STAGE], OUTPUT_STRIDE // 8)
    shift = _ALIGNMENT_PX  # colours lie where they are: undo the alignment
    unmoved = F.pad(pixels, (shift, 0, shift, 0), mode="replicate")[..., :-shift, :-shift]
    colors = F.pixel_unshuffle(F.avg_pool2d(unmoved, _COLOR_PX), OUTPUT_STRIDE // _COLOR_PX)
    return [final, early[_PART_STAGE], surface, colors]


def to_network_input(
    images: Tensor, size: tuple[int, int], dtype: torch.dtype = torch.float32
) -> Tensor:
    """Resize, normalise and align images for `cell_features`.

    Args:
        images: (V, 3, H, W) uint8.
        size: Height and width to resize to, both multiples of 32.
        dtype: The network's type. With bfloat16 the resized pixels are rounded to whole steps of
            0..255, which takes a tenth of the time and moves features less than bfloat16 does.

    Returns:
        (V, 3, height, width) in -1..1, of the network's type and with channels innermost, moved by
        a few pixels so that what a cell looks at lies in its middle.
    """
    pixels = images if dtype == torch.bfloat16 else images.float()
    resized = F.interpolate(
        pixels, size=size, mode="bilinear", antialias=True, align_corners=False
    ).float()
    shift = _ALIGNMENT_PX
    aligned = F.pad(resized, (0, shift, 0, shift), mode="replicate")[..., shift:, shift:]
    # Mean 0.5 and deviation 0.5, as the network was trained.
    scaled = aligned.div_(127.5).sub_(1.0)
    return scaled.to(dtype=dtype, memory_format=torch.channels_last)
