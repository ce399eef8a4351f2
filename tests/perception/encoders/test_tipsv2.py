"""TIPSv2 on tiny random weights."""

from __future__ import annotations

from pathlib import Path

import pytest
from safetensors.torch import load_file, save_file

from onemap_perception.encoders.tipsv2 import read_model
from onemap_perception.errors import BackendError
from tests.perception.tiny import tipsv2_folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tipsv2_folder(tmp_path_factory.mktemp("tipsv2"))


def test_a_missing_tensor_is_refused_by_name(folder: Path, tmp_path: Path) -> None:
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    weights = load_file(tmp_path / "model.safetensors")
    del weights["vision_encoder.norm.weight"]
    save_file(weights, tmp_path / "model.safetensors", metadata={"format": "pt"})
    with pytest.raises(BackendError, match=r"it lacks vision_model\.layernorm\.weight"):
        read_model(tmp_path)
