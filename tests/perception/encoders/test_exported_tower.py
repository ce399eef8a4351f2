"""An exported tower in onnxruntime, and files that do not fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from onemap_perception.encoders.protocol import EncoderError
from onemap_perception.encoders.torch_encoder import ENCODER_KEY, INPUT, OUTPUT, ExportedTower

PIXELS = np.random.default_rng(0).random((1, 3, 4, 5)).astype(np.float32) + 0.1


def exported(path: Path, encoder_id: str = "toy-1") -> Path:
    """A network whose features are each pixel's channels."""
    graph = helper.make_graph(
        [helper.make_node("Transpose", [INPUT], [OUTPUT], perm=[0, 2, 3, 1])],
        "tower",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, [1, 3, 4, 5])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, [1, 4, 5, 3])],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {ENCODER_KEY: encoder_id})
    onnx.save(model, str(path))
    return path


def test_features_are_normalised(tmp_path: Path) -> None:
    tower = ExportedTower(exported(tmp_path / "tower.onnx"), "cpu", "toy-1")
    expected = PIXELS[0].transpose(1, 2, 0)
    expected = expected / np.linalg.norm(expected, axis=-1, keepdims=True)
    np.testing.assert_allclose(tower(PIXELS), expected, atol=1e-3)


def test_features_that_are_not_finite_are_an_error(tmp_path: Path) -> None:
    tower = ExportedTower(exported(tmp_path / "tower.onnx"), "cpu", "toy-1")
    with pytest.raises(EncoderError, match="are not finite"):
        tower(np.full_like(PIXELS, np.inf))


def test_an_image_of_another_size_is_refused_with_both_sizes(tmp_path: Path) -> None:
    tower = ExportedTower(exported(tmp_path / "tower.onnx"), "cpu", "toy-1")
    with pytest.raises(EncoderError, match=r"exported for 5 x 4, this image needs 3 x 4"):
        tower(PIXELS[..., :3])


def test_a_tower_of_another_encoder_is_refused(tmp_path: Path) -> None:
    path = exported(tmp_path / "tower.onnx", encoder_id="toy-2")
    with pytest.raises(EncoderError, match=r"was exported from toy-2, not from toy-1"):
        ExportedTower(path, "cpu", "toy-1")


def test_a_missing_or_damaged_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "tower.onnx"
    with pytest.raises(EncoderError, match=r"tower\.onnx does not exist: onemap export-encoder"):
        ExportedTower(path, "cpu", "toy-1")
    path.write_bytes(b"not a network")
    with pytest.raises(EncoderError, match=r"tower\.onnx cannot be run"):
        ExportedTower(path, "cpu", "toy-1")
