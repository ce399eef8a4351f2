"""The classifier of the encoder ``photo`` as ONNX, from its package: ``python -m`` this module.

EfficientNet-Lite0 (Apache-2.0) with ImageNet's classifier, at every position of the image, of
which only the household names are kept. Its last convolutions with stride 2 take every position,
and those behind them every second input, so that positions are 16 pixels apart.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import onnx
import torch
from torch import Tensor, nn

from onemap_perception.encoders.photo import FOLDER, NETWORK_FILE, household_names
from onemap_perception.onnx import open_session
from onemap_tools.export.mini import store_weights_as_half
from onemap_tools.export.onnx_file import MIN_COSINE, export_module, least_cosine
from onemap_tools.train.network import (
    EPSILON,
    INSTALL,
    RGB_MEAN,
    RGB_SCALE,
    STAGES,
    DepthwiseConv,
    EfficientNetLite0,
    find_backbone_weights,
    load_backbone_weights,
)

HEAD_WIDTH = 1280
COARSE_STAGES = 5  # from this one on, strides were 32


class HouseholdClassifier(nn.Module):
    """RGB (H, W, 3) uint8 to probabilities (h, w, N) of N of ImageNet's names at every position."""

    def __init__(self, weights: Path, names: list[int]) -> None:
        super().__init__()
        self.backbone = EfficientNetLite0()
        load_backbone_weights(self.backbone, weights)
        _space_16_apart(self.backbone)
        source = torch.load(weights, map_location="cpu", weights_only=True)
        self.head = nn.Conv2d(STAGES[-1].width, HEAD_WIDTH, 1, bias=False)
        self.norm = nn.BatchNorm2d(HEAD_WIDTH, eps=EPSILON)
        self.classifier = nn.Linear(HEAD_WIDTH, len(names))
        self.head.load_state_dict(dict(_part(source, "_conv_head.")))
        self.norm.load_state_dict(dict(_part(source, "_bn1.")))
        self.classifier.load_state_dict(
            {name: tensor[names] for name, tensor in _part(source, "_fc.")}
        )

    def forward(self, rgb: Tensor) -> Tensor:
        """Probabilities that sum to one: as if every position showed one of the names."""
        x = (rgb.permute(2, 0, 1)[None].float() - RGB_MEAN) / RGB_SCALE
        x = nn.functional.relu6(self.norm(self.head(self.backbone(x)[-1])))
        shares: Tensor = self.classifier(x[0].permute(1, 2, 0)).softmax(dim=-1)
        return shares


def _part(source: dict[str, Tensor], prefix: str) -> Iterator[tuple[str, Tensor]]:
    for name, tensor in source.items():
        if name.startswith(prefix):
            yield name.removeprefix(prefix), tensor


def _space_16_apart(backbone: EfficientNetLite0) -> None:
    """Take the last stride of 2 out; the convolutions behind it reach as far as before."""
    for stage in backbone.stages[COARSE_STAGES:]:
        for module in stage.modules():
            if not isinstance(module, DepthwiseConv):
                continue
            if module.stride == (2, 2):
                module.stride = (1, 1)
            else:
                reach = module.kernel_size[0] // 2 * 2
                module.dilation, module.padding = (2, 2), (reach, reach)


def export_classifier(path: Path) -> float:
    """Write the file with weights in half precision; the least cosine of a position to torch."""
    weights = find_backbone_weights()
    if weights is None:
        raise SystemExit(f"EfficientNet-Lite0's weights are not installed: {INSTALL}")
    names = [number for each in household_names().values() for number in each.values()]
    network = HouseholdClassifier(weights, names).eval()
    model = export_module(
        network,
        torch.zeros(480, 640, 3, dtype=torch.uint8),
        path,
        names=("rgb", "shares"),
        dynamic_axes={"rgb": {0: "H", 1: "W"}, "shares": {0: "h", 1: "w"}},
    )
    store_weights_as_half(model)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, str(path))
    noise = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    with torch.inference_mode():
        expected = network(torch.from_numpy(noise)).numpy()
    exported = open_session(path, threads=1).run(None, {"rgb": noise})[0]
    return least_cosine(exported, expected)


if __name__ == "__main__":
    written = FOLDER / NETWORK_FILE
    cosine = export_classifier(written)
    if not cosine >= MIN_COSINE:
        raise SystemExit(f"the exported classifier differs from torch: least cosine {cosine:.5f}")
    digest = hashlib.sha256(written.read_bytes()).hexdigest()
    print(f"{written}: SHA-256 {digest}, least cosine to torch {cosine:.6f}")
