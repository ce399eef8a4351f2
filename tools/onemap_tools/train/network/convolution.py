"""Convolutions whose weights may come from elsewhere, and a depthwise one that trains fast."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

PART = 3  # kernel size whose weight gradient CPUs compute fast


class Conv(nn.Conv2d):
    """A convolution that can be given other weights than its own."""

    def convolve(self, x: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
        """As ``forward``, by these weights."""
        return functional.conv2d(x, weight, bias, self.stride, self.padding, groups=self.groups)


class DepthwiseConv(Conv):
    """Depthwise convolution, output size rounded up; computed in float32.

    On a CPU its gradient is slower in bfloat16. Its output is not: what follows is limited by
    the memory's bandwidth.
    """

    def __init__(self, channels: int, kernel: int, stride: int = 1) -> None:
        super().__init__(
            channels, channels, kernel, stride, kernel // 2, groups=channels, bias=False
        )

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, h, w) to (B, C, ceil(h / stride), ceil(w / stride)) of the same dtype."""
        return self.convolve(x, self.weight, None)

    def convolve(self, x: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
        """As ``forward``, by these weights; weights without a gradient take any dtype."""
        if not weight.requires_grad:
            return super().convolve(x, weight, bias)
        with torch.autocast(x.device.type, enabled=False):
            if self.training and x.device.type == "cpu" and self.kernel_size[0] == 2 * PART - 1:
                y = _depthwise5(x.float(), weight.float(), self.stride[0])
                y = y if bias is None else y + bias[:, None, None]
            else:
                y = super().convolve(x.float(), weight.float(), bias)
            return y.to(x.dtype)


class _Depthwise5(torch.autograd.Function):
    """5 x 5, with the gradient of the weights from four gradients of 3 x 3.

    oneDNN has fast code for the latter alone.
    """

    @staticmethod
    def forward(context: Any, x: Tensor, weight: Tensor, stride: int) -> Tensor:
        context.save_for_backward(x, weight)
        context.stride = stride
        return functional.conv2d(x, weight, None, stride, PART - 1, groups=len(weight))

    @staticmethod
    def backward(context: Any, *gradients: Tensor) -> tuple[Tensor, Tensor, None]:
        x, weight = context.saved_tensors
        stride, gradient = context.stride, gradients[0]
        towards_x, _ = _backward(gradient, (x, weight), (stride, PART - 1), (True, False))
        return towards_x, _weight_gradient(gradient, x, weight, stride), None


def _depthwise5(x: Tensor, weight: Tensor, stride: int) -> Tensor:
    y: Tensor = _Depthwise5.apply(x, weight, stride)  # type: ignore[no-untyped-call]
    return y


def _weight_gradient(gradient: Tensor, x: Tensor, weight: Tensor, stride: int) -> Tensor:
    """(C, 1, 5, 5), put together from its four corners of 3 x 3, which overlap."""
    padded = functional.pad(x, (PART - 1,) * 4)
    height, width = ((size - 1) * stride + PART for size in gradient.shape[2:])
    part, result = weight[:, :, :PART, :PART].contiguous(), torch.empty_like(weight)
    for row in (0, PART - 1):
        for column in (0, PART - 1):
            seen = padded[:, :, row : row + height, column : column + width]
            seen = seen.contiguous(memory_format=torch.channels_last)
            _, corner = _backward(gradient, (seen, part), (stride, 0), (False, True))
            result[:, :, row : row + PART, column : column + PART] = corner
    return result


def _backward(
    gradient: Tensor,
    of: tuple[Tensor, Tensor],
    stride_and_padding: tuple[int, int],
    wanted: tuple[bool, bool],
) -> tuple[Tensor, Tensor]:
    """Gradients of a depthwise convolution to its input and its weights, None where not wanted."""
    stride, padding = ([value, value] for value in stride_and_padding)
    x, weight = of
    groups, mask = len(weight), [*wanted, False]
    towards_x, towards_weight, _ = torch.ops.aten.convolution_backward(
        gradient, x, weight, None, stride, padding, [1, 1], False, [0, 0], groups, mask
    )
    return towards_x, towards_weight
