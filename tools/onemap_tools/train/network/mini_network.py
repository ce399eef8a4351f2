"""The network of ``mini``: an EfficientNet-Lite backbone with a feature pyramid to stride 8.

The map at stride 32 and its mean over the image give every patch the context of its room; the
map at stride 4 locates edges. Lin et al., "Feature Pyramid Networks for Object Detection" (2017).
"""

from __future__ import annotations

from torch import Tensor, nn
from torch.nn import functional

from onemap_tools.train.network.backbone import WIDTHS, EfficientNetLite0
from onemap_tools.train.network.convolution import DepthwiseConv

RGB_MEAN, RGB_SCALE = 127.0, 128.0  # the input normalisation of the backbone's weights, of 0..255
PYRAMID_WIDTH = 128
COARSE_BLOCKS, FINE_BLOCKS = 1, 2  # at strides 16 and 8
FEATURE_DIM = 384  # of MiniLM's sentence embeddings


class ConvNeXtBlock(nn.Module):
    """Depthwise convolution, then an inverted pointwise bottleneck, added to the input.

    Liu et al., "A ConvNet for the 2020s" (2022), with batch norm in place of layer norm: it folds
    into the convolutions when exported.
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
    """RGB (B, 3, H, W) float in 0..255 to unit features (B, 384, H / 8, W / 8).

    H and W are multiples of 8.
    """

    def __init__(self) -> None:
        super().__init__()
        width4, *widths = WIDTHS
        self.backbone = EfficientNetLite0()
        self.laterals = nn.ModuleList(_projection(width, PYRAMID_WIDTH) for width in widths)
        self.edges = _projection(width4, PYRAMID_WIDTH, stride=2)
        self.context = nn.Linear(widths[-1], PYRAMID_WIDTH)
        self.coarse = nn.Sequential(*(ConvNeXtBlock(PYRAMID_WIDTH) for _ in range(COARSE_BLOCKS)))
        self.fine = nn.Sequential(*(ConvNeXtBlock(PYRAMID_WIDTH) for _ in range(FINE_BLOCKS)))
        self.head = nn.Conv2d(PYRAMID_WIDTH, FEATURE_DIM, 1)

    def forward(self, rgb: Tensor) -> Tensor:
        """Features of length one."""
        return functional.normalize(self.forward_features(rgb), dim=1)

    def forward_features(self, rgb: Tensor) -> Tensor:
        """Features before they are normalised, which the loss does more cheaply."""
        at4, at8, at16, at32 = self.backbone((rgb - RGB_MEAN) / RGB_SCALE)
        to8, to16, to32 = self.laterals
        context = self.context(at32.mean(dim=(2, 3)))[:, :, None, None]
        merged = self.coarse(to16(at16) + _upsample_to(to32(at32) + context, at16))
        merged = self.fine(to8(at8) + self.edges(at4) + _upsample_to(merged, at8))
        features: Tensor = self.head(merged)
        return features


def _projection(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    kernel = 2 * stride - 1
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False),
        nn.BatchNorm2d(outputs),
    )


def _upsample_to(x: Tensor, like: Tensor) -> Tensor:
    return functional.interpolate(x, size=like.shape[2:], mode="bilinear")
