"""A small module as ONNX, and the comparison of features."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from onemap_perception.onnx import open_session
from onemap_tools.export.onnx_file import OPSET, export_module, least_cosine


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


def test_the_least_cosine_is_that_of_the_worst_patch() -> None:
    first = np.array([[[1.0, 0.0], [0.0, 2.0]]])
    second = np.array([[[3.0, 0.0], [1.0, 1.0]]])
    assert least_cosine(first, second) == pytest.approx(np.sqrt(0.5))
    assert least_cosine(first, -second) == pytest.approx(-1)
