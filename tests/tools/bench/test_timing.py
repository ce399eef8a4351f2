"""The benchmarks of time: what they draw is right, and all that they report is measured."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from onemap_shared.camera import unproject_to_map
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_tools.bench import clients, fusion, perception, planning, query
from onemap_tools.bench.machine import clock_of, wall_clock
from onemap_tools.bench.options import (
    ClientsBench,
    FusionBench,
    PerceptionBench,
    PlanningBench,
    QueryBench,
)
from tests.perception.tiny import OPEN_CLIP_CONFIG, needs_open_clip
from tests.tools.fake_gateway import Routes, fake_gateway

GPU, CPU = torch.device("cuda", 1), torch.device("cpu")
MAPPER = {
    "name": "mapper", "condition": "ready", "problem": "", "alive": True, "ready": True,
    "heartbeat_age_s": 0.1, "metrics": {"frames_fused": 7},
}  # fmt: skip
REPLY = {"text": "sofa", "regions": []}
ROUTES: Routes = {
    ("POST", "/v1/queries"): (200, REPLY),
    ("GET", "/v1/status"): (200, {"services": [MAPPER]}),
}


def untold(_line: str) -> None:
    """Progress that nobody reads."""


def test_a_gpu_is_timed_when_it_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[torch.device] = []
    monkeypatch.setattr(torch.cuda, "synchronize", waited.append)
    for clock in (clock_of(GPU, 1), wall_clock(GPU)):
        assert clock() <= clock()
    assert waited == [GPU] * 4


def test_every_pixel_sees_the_surface_of_the_room() -> None:
    T_map_camera = pose_2d(1.0, -0.5, 2.5) @ camera_mount(0.0, 1.0, np.deg2rad(15))
    points = unproject_to_map(fusion.room_depth(T_map_camera), fusion.CAMERA, T_map_camera)
    low, high = fusion.ROOM_LOW, fusion.ROOM_HIGH
    to_faces = np.minimum(np.abs(points - low), np.abs(points - high))
    assert to_faces.min(axis=-1).max() < 1e-4
    assert ((points > np.subtract(low, 1e-4)) & (points < np.add(high, 1e-4))).all()


def test_fusing_is_measured_with_its_memory() -> None:
    result = fusion.run(FusionBench(frames=2), untold)
    assert (result["frames"], result["image"], result["features"]) == (2, "640x480", "24x24x768")
    assert 0 < result["min_ms"] <= result["p50_ms"] <= result["p95_ms"]
    assert min(result["cpu_min_ms"], result["observe_p50_ms"], result["absorb_p50_ms"]) > 0
    assert result["cells"] > 1000
    assert 0 < result["map_bytes"] < result["peak_process_bytes"]
    assert result["device"] == "cpu"


@pytest.mark.parametrize(("dtype", "value_bytes"), [("float32", 4), ("float16", 2)])
def test_all_times_of_a_query_are_measured(dtype: Any, value_bytes: int) -> None:
    result = query.run(QueryBench(cells=5000, feature_dtype=dtype), untold)
    times = [value for name, value in result.items() if name.endswith(("_ms", "_per_frame"))]
    assert len(times) == 11
    assert all(value > 0 for value in times)
    assert result["loaded_map_bytes"] > result["table_bytes"]
    assert result["table_bytes"] == 5000 * query.CHANNELS * value_bytes


def test_all_times_of_planning_are_measured() -> None:
    result = planning.run(PlanningBench(side=20, steps=2), untold)
    assert result["comparing_steps"] > 0
    assert min(result["frontiers"], result["regions"]) > 0
    assert all(value > 0 for name, value in result.items() if name.endswith("_ms"))


@needs_open_clip
def test_an_encoder_with_random_weights_is_measured_or_says_why_not(tmp_path: Path) -> None:
    file = tmp_path / "tiny.json"
    file.write_text(json.dumps(OPEN_CLIP_CONFIG), encoding="utf-8")
    asked = PerceptionBench(
        random_weights=True,
        backend=["openclip_convnext"],
        architecture=str(file),
        device=["cpu"],
        size="64x48",
        frames=2,
    )
    (result,) = perception.run(asked, untold)["results"]
    assert (result["backend"], result["device"]) == ("openclip_convnext", "cpu")
    assert result["features"] == "15x20x16"
    assert 0 < result["frame_p50_ms"] <= result["frame_p95_ms"]
    assert "network_p50_ms" not in result  # no device events on a CPU
    file.unlink()
    (result,) = perception.run(asked, untold)["results"]
    assert "describes no OpenCLIP model" in result["problem"]


@needs_open_clip
def test_the_configured_encoder_is_measured() -> None:
    (result,) = perception.run(PerceptionBench(size="320x240", frames=1), untold)["results"]
    assert (result["backend"], result["features"]) == ("mini", "30x40x384")


@pytest.mark.parametrize(("new", "kind"), [(0.0, "known"), (1.0, "new")])
def test_every_query_of_every_client_is_counted(new: float, kind: str) -> None:
    with fake_gateway(ROUTES) as url:
        options = ClientsBench(url=url, clients=3, seconds=0.2, new=new, pause=0.0)
        result = clients.run(options, untold)
    other = {"known": "new", "new": "known"}[kind]
    assert result[kind]["queries"] >= 3
    assert result[kind]["refused"] == 0
    assert 0 <= result[kind]["p50_ms"] <= result[kind]["p99_ms"] <= result[kind]["max_ms"]
    assert (result[other]["queries"], result[other]["p50_ms"]) == (0, None)
    assert (result["clients"], result["fused_hz"]) == (3, 0.0)


def test_refusals_are_counted_with_the_first_reason() -> None:
    times = [(True, 0.1, ""), (True, 3.0, "busy"), (True, 3.0, "silent")]
    summary = clients.summarise([clients.QueryTime(*each) for each in times])
    assert (summary["queries"], summary["refused"], summary["first_refusal"]) == (3, 2, "busy")
    assert summary["max_ms"] == 100
