"""TIPSv2 on tiny random weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from safetensors.torch import load_file, save_file

from onemap_perception.config import Tipsv2Params
from onemap_perception.encoders.tipsv2 import read_model
from onemap_perception.encoders.torch_encoder import TorchEncoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from tests.perception.tiny import EMBED_DIM, tipsv2_folder


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


@pytest.fixture(scope="module")
def encoder(folder: Path) -> TorchEncoder:
    encoder = make_encoder(Tipsv2Params(model=str(folder), long_side_px=56))
    assert isinstance(encoder, TorchEncoder)
    return encoder


def test_features_cover_the_image(encoder: TorchEncoder) -> None:
    rng = np.random.default_rng(0)
    features = encoder.encode(rng.integers(0, 256, (48, 64, 3)).astype(np.uint8))
    assert features.shape == (3, 4, EMBED_DIM)
    np.testing.assert_allclose(np.linalg.norm(features.astype(np.float32), axis=-1), 1, atol=2e-3)
