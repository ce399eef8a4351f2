"""The exported network of ``mini`` and the embedding table of its words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from onemap_perception.onnx import open_session
from onemap_tools.models.onnx_file import OPSET, export_module
from onemap_tools.train.export import compare_with_torch, export_network
from onemap_tools.train.network import MiniNetwork

IMAGES = np.random.default_rng(0).integers(0, 256, (2, 64, 88, 3), dtype=np.uint8)


def test_what_is_exported_agrees_with_torch_and_is_small(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = MiniNetwork().eval()
    path = export_network(network, tmp_path)
    assert compare_with_torch(network, path, IMAGES) > 0.999
    assert path.stat().st_size < 12 * 2**20
    other = MiniNetwork().eval()
    assert compare_with_torch(other, path, IMAGES) < 0.9


def test_the_file_computes_what_the_module_does_at_any_size(tmp_path: Path) -> None:
    module = torch.nn.Conv2d(3, 2, 3, padding=1).eval()
    path = tmp_path / "conv.onnx"
    model = export_module(
        module,
        torch.zeros(1, 3, 8, 8),
        path,
        names=("image", "features"),
        dynamic_axes={"image": {3: "W"}, "features": {3: "W"}},
    )
    assert model.opset_import[0].version == OPSET
    image = torch.rand(1, 3, 8, 12)
    (features,) = open_session(path, threads=1).run(["features"], {"image": image.numpy()})
    with torch.inference_mode():
        np.testing.assert_allclose(features, module(image).numpy(), atol=1e-5)
