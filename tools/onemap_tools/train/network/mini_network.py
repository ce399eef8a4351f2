"""The network of ``mini``: an EfficientNet-Lite trunk with a feature pyramid, stride 8.

The map at stride 32 and a mean over the whole picture give every patch the context of its
room, the one at stride 4 knows where edges are.
"""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor, nn
from torch.nn import functional

from onemap_tools.train.network.backbone import WIDTHS, DepthwiseConv, EfficientNetLite0

MIDDLE, HALF_RANGE = 127.0, 128.0  # what the trunk's weights expect of RGB in 0..255


@dataclass(frozen=True, slots=True)
class MiniNetworkParams:
    """Width of the pyramid, its blocks at strides 16 and 8, and numbers per patch."""

    pyramid: int = 128
    coarse_blocks: int = 1
    fine_blocks: int = 2
    dim: int = 384


class ConvNeXtBlock(nn.Module):
    """ConvNeXt's: depthwise, then a pointwise bottleneck turned inside out, added to the input.

    Batch norm in place of layer norm folds into the convolutions when exported.
    """

    def __init__(self, width: int, kernel: int = 5) -> None:
        super().__init__()
        last = nn.BatchNorm2d(width)
        nn.init.constant_(last.weight, 0.1)  # deep stacks start near the identity
        self.body = nn.Sequential(
            DepthwiseConv(width, kernel),
            nn.BatchNorm2d(width),
            nn.Conv2d(width, 4 * width, 1),
            nn.ReLU(inplace=True),
            nn.Conv2d(4 * width, width, 1, bias=False),
            last,
        )

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, h, w) to the same shape."""
        y: Tensor = x + self.body(x)
        return y


class MiniNetwork(nn.Module):
    """RGB (B, 3, H, W) float in 0..255 to unit features (B, dim, H / 8, W / 8).

    H and W are multiples of 8.
    """

    def __init__(self, shape: MiniNetworkParams | None = None) -> None:
        super().__init__()
        shape = shape or MiniNetworkParams()
        stride4, *widths = WIDTHS
        self.trunk = EfficientNetLite0()
        self.laterals = nn.ModuleList(_projection(width, shape.pyramid) for width in widths)
        self.edges = _projection(stride4, shape.pyramid, stride=2)
        self.context = nn.Linear(widths[-1], shape.pyramid)
        self.coarse = nn.Sequential(
            *(ConvNeXtBlock(shape.pyramid) for _ in range(shape.coarse_blocks))
        )
        self.fine = nn.Sequential(*(ConvNeXtBlock(shape.pyramid) for _ in range(shape.fine_blocks)))
        self.head = nn.Conv2d(shape.pyramid, shape.dim, 1)

    def forward(self, rgb: Tensor) -> Tensor:
        """See the class."""
        return functional.normalize(self.forward_unnormalised(rgb), dim=1)

    def forward_unnormalised(self, rgb: Tensor) -> Tensor:
        """The same features before they are brought to length one."""
        at4, at8, at16, at32 = self.trunk((rgb - MIDDLE) / HALF_RANGE)
        to8, to16, to32 = self.laterals
        context = self.context(at32.mean(dim=(2, 3)))[:, :, None, None]
        merged = self.coarse(to16(at16) + _upsample_to(to32(at32) + context, at16))
        merged = self.fine(to8(at8) + self.edges(at4) + _upsample_to(merged, at8))
        features: Tensor = self.head(merged)
        return features


def _projection(inside: int, outside: int, stride: int = 1) -> nn.Sequential:
    kernel = 2 * stride - 1
    return nn.Sequential(
        nn.Conv2d(inside, outside, kernel, stride, kernel // 2, bias=False),
        nn.BatchNorm2d(outside),
    )


def _upsample_to(x: Tensor, like: Tensor) -> Tensor:
    return functional.interpolate(x, size=like.shape[2:], mode="bilinear")
