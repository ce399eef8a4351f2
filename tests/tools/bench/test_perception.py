"""The benchmark measures encoders, and reports why it cannot."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from onemap_perception.encoders.mini import MiniParams
from onemap_tools.bench import perception
from onemap_tools.bench.perception import (
    MeasuredEncoder,
    PerceptionBenchParams,
    measure,
    parse_size,
    run,
    run_configured,
)
from tests.perception.tiny import OPEN_CLIP_CONFIG, needs_open_clip

pytestmark = needs_open_clip


def bench_params(**changes: Any) -> PerceptionBenchParams:
    """One frame of a small image."""
    values: dict[str, Any] = {
        "frames": 1,
        "size_px": (64, 48),
        "architecture": "",
        "devices": ("cpu",),
    }
    return PerceptionBenchParams(**(values | changes))


@pytest.fixture
def tiny(tmp_path: Path) -> str:
    """The architecture of a small openclip_convnext."""
    file = tmp_path / "tiny.json"
    file.write_text(json.dumps(OPEN_CLIP_CONFIG), encoding="utf-8")
    return str(file)


def test_random_weights_are_measured(tiny: str) -> None:
    document = run(("openclip_convnext",), bench_params(frames=2, architecture=tiny))
    assert (document["image"], document["frames"]) == ("64x48", 2)
    (result,) = document["results"]
    assert (result["backend"], result["device"]) == ("openclip_convnext", "cpu")
    assert result["features"] == "15x20x16"
    assert 0 < result["frame_p50_ms"] <= result["frame_p95_ms"]
    assert result["frames_per_s"] == pytest.approx(1e3 / result["frame_p50_ms"], rel=0.02)
    assert result["peak_process_bytes"] > 0
    assert "network_p50_ms" not in result  # no device events on a CPU


def test_the_configured_encoder_is_measured() -> None:
    (result,) = run_configured(MiniParams(), bench_params(size_px=(320, 240)))["results"]
    assert (result["backend"], result["device"]) == ("mini", "cpu")
    assert result["features"] == "30x40x384"


def test_what_cannot_run_says_why(tmp_path: Path) -> None:
    params = bench_params(architecture=str(tmp_path / "no.json"))
    (result,) = run(("openclip_convnext",), params)["results"]
    assert "describes no OpenCLIP model" in result["problem"]


def test_sizes_are_read_as_width_and_height() -> None:
    assert parse_size("640x480") == (640, 480)
    for text in ("640", "x480", "640x0", "640x480x3"):
        with pytest.raises(ValueError, match="write it like 640x480"):
            parse_size(text)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
def test_on_cuda_the_network_is_timed_with_events(tiny: str) -> None:
    params = bench_params(frames=3, architecture=tiny, devices=("cuda",))
    (result,) = run(("openclip_convnext",), params)["results"]
    assert 0 < result["network_p50_ms"] <= result["frame_p50_ms"]
    assert result["peak_device_bytes"] > 0


def test_warm_up_frames_do_not_count() -> None:
    calls: list[int] = []

    def encode(rgb: object) -> np.ndarray:
        calls.append(1)
        return np.zeros((1, 1, 3), np.float16)

    result = measure(MeasuredEncoder(encode), bench_params(frames=4), on_gpu=False)
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
