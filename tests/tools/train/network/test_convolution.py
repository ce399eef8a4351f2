"""The depthwise convolution of the training equals torch's, with its gradients."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from onemap_tools.train.network.convolution import Conv, DepthwiseConv


@pytest.mark.parametrize("kernel", [3, 5])
@pytest.mark.parametrize("stride", [1, 2])
@pytest.mark.parametrize("size", [(6, 7), (11, 14), (1, 2)])
def test_gradients_are_those_of_torch(kernel: int, stride: int, size: tuple[int, int]) -> None:
    torch.manual_seed(0)
    layer = DepthwiseConv(16, kernel, stride).double()
    x = torch.randn(3, 16, *size, dtype=torch.float64, requires_grad=True)
    x32, weight = x.float().detach().requires_grad_(), layer.weight.detach().requires_grad_()
    expected = functional.conv2d(x, weight, None, stride, kernel // 2, groups=16)
    y = layer.float()(x32)
    assert y.shape[2:] == tuple(-(-side // stride) for side in size)
    torch.testing.assert_close(y.double(), expected, rtol=1e-4, atol=1e-4)
    towards = torch.randn_like(expected)
    grads = torch.autograd.grad(y, (x32, layer.weight), towards.float())
    for mine, exact in zip(grads, torch.autograd.grad(expected, (x, weight), towards), strict=True):
        torch.testing.assert_close(mine.double(), exact, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("layer", [Conv(8, 8, 1), DepthwiseConv(8, 5), DepthwiseConv(8, 3)])
def test_other_weights_and_an_offset_can_be_given(layer: Conv) -> None:
    torch.manual_seed(0)
    x, weight, bias = torch.randn(2, 8, 6, 7), torch.randn_like(layer.weight), torch.randn(8)
    expected = functional.conv2d(x, weight, bias, 1, layer.padding, groups=layer.groups)
    for each in (weight, weight.clone().requires_grad_()):
        torch.testing.assert_close(layer.convolve(x, each, bias), expected, rtol=1e-4, atol=1e-4)


def test_the_output_has_the_dtype_of_the_input() -> None:
    layer, x = DepthwiseConv(8, 5), torch.randn(2, 8, 6, 7).bfloat16()
    y = layer(x)
    assert y.dtype == torch.bfloat16
    y.float().sum().backward()
    assert layer.weight.grad is not None
    assert layer.weight.grad.dtype == torch.float32
