"""The network of ``mini``: a small ConvNeXt with a feature pyramid, stride 8.

Batch norm in place of ConvNeXt's layer norm folds into the convolutions when exported, and
ReLU costs nothing on a CPU. A stage at stride 32 and a mean over the whole picture give
every patch the context of its room.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

MEAN_RGB = (0.48, 0.46, 0.42)  # of common indoor pictures; exactness does not matter
STD_RGB = (0.27, 0.26, 0.27)


@dataclass(frozen=True, slots=True)
class NetworkShape:
    """Widths and depths of the stages at strides 4, 8, 16 and 32, and of the pyramid."""

    widths: tuple[int, int, int, int] = (32, 64, 160, 256)
    depths: tuple[int, int, int, int] = (1, 2, 6, 2)
    pyramid: int = 128
    refinements: int = 1
    dim: int = 384


class Block(nn.Module):
    """Depthwise 7 x 7, then a pointwise bottleneck turned inside out, added to the input."""

    def __init__(self, width: int, kernel: int = 7) -> None:
        super().__init__()
        last = nn.BatchNorm2d(width)
        nn.init.constant_(last.weight, 0.1)  # deep stacks start near the identity
        self.body = nn.Sequential(
            nn.Conv2d(width, width, kernel, padding=kernel // 2, groups=width, bias=False),
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


def _down(inside: int, outside: int) -> nn.Sequential:
    """Half the resolution, rounded up."""
    return nn.Sequential(
        nn.Conv2d(inside, outside, 3, stride=2, padding=1, bias=False), nn.BatchNorm2d(outside)
    )


class MiniNetwork(nn.Module):
    """RGB (B, 3, H, W) float in 0..255 to unit features (B, dim, H / 8, W / 8).

    H and W are multiples of 8.
    """

    mean: Tensor
    std: Tensor

    def __init__(self, shape: NetworkShape | None = None) -> None:
        super().__init__()
        shape = shape or NetworkShape()
        widths = shape.widths
        self.register_buffer("mean", 255 * torch.tensor(MEAN_RGB).view(1, 3, 1, 1))
        self.register_buffer("std", 255 * torch.tensor(STD_RGB).view(1, 3, 1, 1))
        self.stem = nn.Sequential(
            nn.Conv2d(3, widths[0], 4, stride=4, bias=False), nn.BatchNorm2d(widths[0])
        )
        self.stages = nn.ModuleList(
            nn.Sequential(
                *([_down(widths[i - 1], width)] if i else []),
                *(Block(width) for _ in range(shape.depths[i])),
            )
            for i, width in enumerate(widths)
        )
        self.context = nn.Linear(widths[3], shape.pyramid)
        self.laterals = nn.ModuleList(nn.Conv2d(w, shape.pyramid, 1) for w in widths[1:])
        self.fine = _down(widths[0], shape.pyramid)  # stride 4 knows where edges are
        self.refine = nn.Sequential(*(Block(shape.pyramid, 5) for _ in range(shape.refinements)))
        self.head = nn.Conv2d(shape.pyramid, shape.dim, 1)

    def forward(self, rgb: Tensor) -> Tensor:
        """See the class."""
        return functional.normalize(self.raw(rgb), dim=1)

    def raw(self, rgb: Tensor) -> Tensor:
        """The same features before they are brought to length one."""
        x = self.stem((rgb - self.mean) / self.std)
        levels = []
        for stage in self.stages:
            x = stage(x)
            levels.append(x)
        merged = self.laterals[2](levels[3])
        merged = merged + self.context(levels[3].mean(dim=(2, 3)))[:, :, None, None]
        for lateral, level in ((self.laterals[1], levels[2]), (self.laterals[0], levels[1])):
            merged = lateral(level) + functional.interpolate(merged, size=level.shape[2:])
        features: Tensor = self.head(self.refine(merged + self.fine(levels[0])))
        return features
