"""The last two stages of the image tower on every second cell: a quarter of the work.

At output stride 16 these stages see the map as four interleaved lattices that do not mix after the
first of their convolutions. Training runs on one of the four, drawn at random.
"""

from collections.abc import Iterator

import torch.nn.functional as F
from timm.models import EfficientNet
from torch import Tensor, nn

_BLOCKS = ((5, 0), (5, 1), (5, 2), (5, 3), (6, 0))
_HAS_SKIP = (False, True, True, True, False)


class LastStages(nn.Module):
    """Stages 5 and 6 and the last convolution, batch norm folded, weights trained in float32."""

    def __init__(self, trunk: EfficientNet) -> None:
        """Copy the weights.

        Args:
            trunk: A folded trunk.
        """
        super().__init__()
        state = trunk.state_dict()

        def copy(conv: str, part: str) -> nn.ParameterList:
            names = [f"blocks.{stage}.{block}.{conv}.{part}" for stage, block in _BLOCKS]
            return nn.ParameterList([_parameter(state[name]) for name in names])

        self.expand, self.expand_bias = copy("conv_pw", "weight"), copy("conv_pw", "bias")
        self.depth, self.depth_bias = copy("conv_dw", "weight"), copy("conv_dw", "bias")
        self.reduce, self.reduce_bias = copy("conv_pwl", "weight"), copy("conv_pwl", "bias")
        self.head = _parameter(state["conv_head.weight"])
        self.head_bias = _parameter(state["conv_head.bias"])

    def forward(self, parts: Tensor, phase: tuple[int, int]) -> Tensor:
        """Compute the input of the last convolution on one lattice.

        Args:
            parts: (P, h, w, 112), h and w even.
            phase: Row and column, 0 or 1, at which the lattice starts.

        Returns:
            (P, h / 2, w / 2, 320).
        """
        x = parts
        for index, has_skip in enumerate(_HAS_SKIP):
            hidden = _linear(x, self.expand[index], self.expand_bias[index])
            hidden = _depthwise(
                hidden, self.depth[index], self.depth_bias[index], phase if index == 0 else None
            )
            out = F.linear(
                hidden, self.reduce[index].to(x.dtype), self.reduce_bias[index].to(x.dtype)
            )
            x = out + x if has_skip else out
        return x

    def finish(self, cells: Tensor) -> Tensor:
        """Apply the last convolution to chosen cells: (N, 320) to (N, 1280)."""
        return _linear(cells, self.head, self.head_bias)


def tower_names() -> Iterator[tuple[str, str]]:
    """Pair what is trained with the tower's names for it; depthwise kernels are not.

    Yields:
        Name in the state of `tools.encoder.training.TrainedPart`, and name in the folded trunk.
    """
    for index, (stage, block) in enumerate(_BLOCKS):
        for own, conv in (("expand", "conv_pw"), ("reduce", "conv_pwl")):
            name = f"blocks.{stage}.{block}.{conv}"
            yield f"stages.{own}.{index}", f"{name}.weight"
            yield f"stages.{own}_bias.{index}", f"{name}.bias"
    yield "stages.head", "conv_head.weight"
    yield "stages.head_bias", "conv_head.bias"


def _parameter(tensor: Tensor) -> nn.Parameter:
    """Copy a tensor of the tower; kernels of one pixel become matrices."""
    is_pointwise = tensor.dim() == 4 and tensor.shape[-1] == 1
    return nn.Parameter((tensor[:, :, 0, 0] if is_pointwise else tensor).float().clone())


def _linear(x: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    return F.relu6(F.linear(x, weight.to(x.dtype), bias.to(x.dtype)))


def _depthwise(x: Tensor, weight: Tensor, bias: Tensor, phase: tuple[int, int] | None) -> Tensor:
    reach = weight.shape[-1] // 2
    maps = x.permute(0, 3, 1, 2)
    stride = 1
    if phase is not None:
        row, column = phase
        maps = F.pad(maps, (reach - column, reach - 1 + column, reach - row, reach - 1 + row))
        reach, stride = 0, 2
    out = F.conv2d(
        maps,
        weight.to(x.dtype),
        bias.to(x.dtype),
        stride=stride,
        padding=reach,
        groups=len(weight),
    )
    return F.relu6(out).permute(0, 2, 3, 1)
