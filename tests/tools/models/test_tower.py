"""``onemap export-encoder`` on a tiny encoder, and the exported file in its place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_tools.cli.app import app
from onemap_tools.models import tower
from onemap_tools.models.onnx_file import least_cosine
from tests.perception.tiny import needs_open_clip, open_clip_folder, tipsv2_folder

pytestmark = needs_open_clip
RGB = np.random.default_rng(3).integers(0, 256, (48, 64, 3)).astype(np.uint8)


def section(backend: str, folder: Path, **more: object) -> dict[str, object]:
    side_px = 64 if backend == "openclip_convnext" else 56
    return {"backend": backend, "model": str(folder), "long_side_px": side_px, **more}


def run(tmp_path: Path, encoder: dict[str, object], out: Path) -> tuple[int, str]:
    config = tmp_path / "config.yaml"
    config.write_text(yaml.safe_dump({"perception": {"encoder": encoder}}), encoding="utf-8")
    arguments = ["export-encoder", str(out), "--config", str(config), "--json"]
    result = CliRunner().invoke(app, arguments)
    return result.exit_code, result.output


@pytest.mark.parametrize("backend", ["openclip_convnext", "tipsv2"])
def test_the_file_stands_in_for_torch(backend: str, tmp_path: Path) -> None:
    make = open_clip_folder if backend == "openclip_convnext" else tipsv2_folder
    folder, out = make(tmp_path / "model"), tmp_path / "tower.onnx"
    code, text = run(tmp_path, section(backend, folder), out)
    assert code == 0, text
    report = json.loads(text.splitlines()[-1])
    assert report["least_cosine"] > 0.999
    assert f"trtexec --onnx={out} --fp16" in report["trtexec"]
    plain = PerceptionConfig.model_validate({"encoder": section(backend, folder)})
    quick = PerceptionConfig.model_validate({"encoder": section(backend, folder, exported=out)})
    torch_encoder, onnx_encoder = make_encoder(plain.encoder), make_encoder(quick.encoder)
    assert torch_encoder.encoder_id == onnx_encoder.encoder_id == report["encoder_id"]
    assert least_cosine(torch_encoder.encode(RGB), onnx_encoder.encode(RGB)) > 0.999
    with pytest.raises(BackendError, match="was exported for"):
        onnx_encoder.encode(RGB[:9])


def test_a_file_of_other_weights_or_a_missing_provider_is_refused(tmp_path: Path) -> None:
    folder, out = open_clip_folder(tmp_path / "a"), tmp_path / "tower.onnx"
    assert run(tmp_path, section("openclip_convnext", folder), out)[0] == 0
    other = open_clip_folder(tmp_path / "b", seed=1)
    cases = {
        "was exported from": section("openclip_convnext", other, exported=out),
        "built without tensorrt": section(
            "openclip_convnext", folder, exported=out, provider="tensorrt"
        ),
        "does not exist": section("openclip_convnext", folder, exported=tmp_path / "no.onnx"),
    }
    for sentence, encoder in cases.items():
        config = PerceptionConfig.model_validate({"encoder": encoder})
        with pytest.raises(BackendError, match=sentence):
            make_encoder(config.encoder)


def test_an_export_that_disagrees_is_not_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, out = open_clip_folder(tmp_path / "model"), tmp_path / "tower.onnx"
    monkeypatch.setattr(tower, "least_cosine", lambda a, b: 0.99)
    code, text = run(tmp_path, section("openclip_convnext", folder), out)
    assert code == 1
    assert "disagrees with torch: cosine 0.99000" in text
    assert not out.exists()


def test_mini_needs_no_export(tmp_path: Path) -> None:
    code, text = run(tmp_path, {"backend": "mini"}, tmp_path / "x.onnx")
    assert code == 2
    assert "runs in onnxruntime already" in text
