"""The benchmark measures, and says why where it cannot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from onemap_tools.bench import perception
from onemap_tools.bench.perception import MeasuredEncoder, PerceptionBenchParams, measure, run
from onemap_tools.cli.app import app
from tests.perception.tiny import OPEN_CLIP_CONFIG

pytest.importorskip("open_clip", reason="needs open_clip_torch (requirements-encoders.txt)")


def bench(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["bench", "perception", *arguments])
    return result.exit_code, result.output


def test_random_weights_are_measured(tmp_path: Path) -> None:
    tiny = tmp_path / "tiny.json"
    tiny.write_text(json.dumps(OPEN_CLIP_CONFIG), encoding="utf-8")
    code, text = bench(
        *("--random-weights", "--backend", "openclip_convnext", "--architecture", str(tiny)),
        *("--device", "cpu", "--frames", "2", "--size", "64x48", "--json"),
    )
    assert code == 0, text
    document = json.loads(text.splitlines()[-1])
    (result,) = document["results"]
    assert (result["backend"], result["device"]) == ("openclip_convnext", "cpu")
    assert result["features"] == "15x20x16"
    assert 0 < result["frame_p50_ms"] <= result["frame_p95_ms"]
    assert result["frames_per_s"] > 0
    assert result["peak_process_bytes"] > 0
    assert "network_p50_ms" not in result  # no device events on a CPU


def test_what_cannot_run_says_why(tmp_path: Path) -> None:
    params = PerceptionBenchParams(frames=1, architecture=str(tmp_path / "no.json"))
    (result,) = run(("openclip_convnext",), params)["results"]
    assert "cannot be read" in result["problem"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--size", "640"), "size is '640'; write it like 640x480"),
        (("--frames", "0"), "at least one must be encoded"),
    ],
)
def test_mistakes_are_told(arguments: tuple[str, ...], sentence: str) -> None:
    code, text = bench(*arguments)
    assert code == 2
    assert sentence in text


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
def test_on_cuda_the_network_is_timed_with_events(tmp_path: Path) -> None:
    tiny = tmp_path / "tiny.json"
    tiny.write_text(json.dumps(OPEN_CLIP_CONFIG), encoding="utf-8")
    params = PerceptionBenchParams(frames=3, architecture=str(tiny), devices=("cuda",))
    (result,) = run(("openclip_convnext",), params)["results"]
    assert 0 < result["network_p50_ms"] <= result["frame_p50_ms"]
    assert result["peak_device_bytes"] > 0


def test_warm_up_frames_do_not_count() -> None:
    calls: list[int] = []

    def encode(rgb: object) -> np.ndarray:
        calls.append(1)
        return np.zeros((1, 1, 3), np.float16)

    result = measure(MeasuredEncoder(encode), PerceptionBenchParams(frames=4), on_gpu=False)
    assert len(calls) == 1 + 5 + 4
    assert result["features"] == "1x1x3"


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs Linux's /proc")
def test_a_backend_does_not_inherit_the_memory_of_another() -> None:
    size = 256 * 2**20
    large = np.ones(size, np.uint8)
    with_it = perception._peak_memory_bytes()
    assert with_it > size
    del large
    perception._reset_peak_memory()
    assert perception._peak_memory_bytes() < with_it - size // 2
