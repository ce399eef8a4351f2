"""The paper's encoder on tiny random weights, through the loading path of the real ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from onemap_perception.config import OpenClipConvNextParams
from onemap_perception.encoders.openclip_convnext import STEM, read_architecture
from onemap_perception.encoders.torch_encoder import TorchEncoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_shared.geometry import U8
from tests.perception.tiny import (
    LAYOUTS,
    OPEN_CLIP_CONFIG,
    needs_open_clip,
    open_clip_file,
    open_clip_folder,
)

pytestmark = needs_open_clip


def load(path: Path, **values: Any) -> TorchEncoder:
    params = OpenClipConvNextParams(**{"model": str(path), "long_side_px": 128, **values})
    encoder = make_encoder(params)
    assert isinstance(encoder, TorchEncoder)
    return encoder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return open_clip_folder(tmp_path_factory.mktemp("openclip"))


@pytest.fixture(scope="module")
def encoder(folder: Path) -> TorchEncoder:
    return load(folder)


def image(height: int, width: int, seed: int = 0) -> U8:
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3)).astype(np.uint8)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_loads_to_the_same_encoder(
    layout: str, tmp_path: Path, encoder: TorchEncoder
) -> None:
    path = open_clip_file(tmp_path, layout)
    loaded = load(path)
    assert (loaded.encoder_id, loaded.text_space) == (encoder.encoder_id, encoder.text_space)
    np.testing.assert_array_equal(loaded.encode(image(9, 9)), encoder.encode(image(9, 9)))


def test_a_missing_visual_key_is_refused_by_name(tmp_path: Path) -> None:
    path = open_clip_file(tmp_path, "bare", without=STEM)
    with pytest.raises(BackendError, match=rf"another architecture: it lacks {STEM}$"):
        load(path)


def test_fine_tuned_images_keep_the_text_space(tmp_path: Path, encoder: TorchEncoder) -> None:
    path = open_clip_file(tmp_path, "bare")
    weights = torch.load(path, weights_only=True)
    weights[STEM] += 0.1
    torch.save(weights, path)
    tuned = load(path)
    assert tuned.text_space == encoder.text_space
    assert tuned.encoder_id != encoder.encoder_id


@pytest.mark.parametrize(
    ("tower", "sentence"),
    [("vit_base_patch16", "takes ConvNeXt towers"), ("test_convnext2", "another architecture")],
)
def test_another_architecture_is_refused(tower: str, sentence: str, tmp_path: Path) -> None:
    path = open_clip_file(tmp_path, "bare")
    vision = {**OPEN_CLIP_CONFIG["vision_cfg"], "timm_model_name": tower}
    config = {**OPEN_CLIP_CONFIG, "vision_cfg": vision}
    path.with_name("open_clip_config.json").write_text(json.dumps(config), encoding="utf-8")
    with pytest.raises(BackendError, match=sentence):
        load(path)


def test_a_tokenizer_of_another_model_is_refused(tmp_path: Path) -> None:
    path = open_clip_file(tmp_path, "bare")
    text = {**OPEN_CLIP_CONFIG["text_cfg"], "hf_tokenizer_name": "google/siglip-base"}
    config = json.dumps({**OPEN_CLIP_CONFIG, "text_cfg": text})
    path.with_name("open_clip_config.json").write_text(config, encoding="utf-8")
    with pytest.raises(BackendError, match="with CLIP's own text tower"):
        load(path)


@pytest.mark.parametrize(("width", "name"), [(128, "base"), (192, "large")])
def test_the_architecture_follows_from_the_tower(width: int, name: str, tmp_path: Path) -> None:
    config = read_architecture(tmp_path / "sed.pth", {STEM: torch.zeros(width, 3, 4, 4)})
    assert config["vision_cfg"]["timm_model_name"] == f"convnext_{name}"


def test_a_folder_without_weights_or_configuration_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BackendError, match=r"holds none of open_clip_model\.safetensors"):
        load(tmp_path)
    lone = tmp_path / "weights.pth"
    torch.save({}, lone)
    with pytest.raises(BackendError, match="beside it"):
        load(lone)
    (tmp_path / "open_clip_config.json").write_text("[]", encoding="utf-8")
    with pytest.raises(BackendError, match="describes no OpenCLIP model"):
        load(lone)
