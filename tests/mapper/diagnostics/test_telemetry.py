"""Counters, metrics and the sentence about the current problem."""

from __future__ import annotations

from math import radians

import pytest

from onemap_mapper.frame.camera_check import CameraPose2D, DepthDiagnostics, LevelSurface
from onemap_mapper.robots import SILENT_AFTER_S, MapperTelemetry
from onemap_shared.transport import Counters

AHEAD = CameraPose2D(0.0, 0.0, 0.0)
GOOD = DepthDiagnostics(0.9, 0.0, AHEAD, LevelSurface(0.01, 0.0))


def fed(*depths: DepthDiagnostics, every_s: float = 0.2) -> MapperTelemetry:
    telemetry = MapperTelemetry()
    for k, depth in enumerate(depths):
        telemetry.record_fused(now_s=k * every_s, update_ms=7.0, depth=depth)
    return telemetry


def test_nothing_is_wrong_with_good_frames() -> None:
    telemetry = fed(GOOD, GOOD)
    assert telemetry.problem(1.0) == ""
    assert telemetry.ready(1.0)


@pytest.mark.parametrize(
    ("depth", "sentence"),
    [
        (DepthDiagnostics(0.0, 0.0, AHEAD), "all zero"),
        (DepthDiagnostics(0.9, 0.8, AHEAD), "nearer than 0.1 m"),
    ],
)
def test_bad_depth_is_reported_but_frames_are_fused(depth: DepthDiagnostics, sentence: str) -> None:
    telemetry = fed(depth)
    assert sentence in telemetry.problem(0.5)
    assert telemetry.ready(0.5)


def turning(height_m: float) -> list[DepthDiagnostics]:
    """Frames of a robot that turns by 180 degrees and sees the floor at this height."""
    headings = [radians(45 * k) for k in range(5)]
    surface = LevelSurface(height_m, 0.0)
    return [DepthDiagnostics(0.9, 0.0, CameraPose2D(0.0, 0.0, h), surface) for h in headings]


def test_a_wrong_floor_is_reported_as_sentence_and_metrics() -> None:
    telemetry = fed(*turning(-0.3))
    assert "z = -0.30 m" in telemetry.problem(2.0)
    assert telemetry.ready(2.0)
    metrics = telemetry.metrics(2.0, Counters())
    assert metrics["floor_height_m"] == pytest.approx(-0.3)
    assert (metrics["floor_wrong"], metrics["floor_viewpoints"]) == (1, 5)


def test_a_new_map_forgets_the_floor() -> None:
    telemetry = fed(*turning(0.3))
    telemetry.reset_floor()
    assert telemetry.problem(1.5) == ""
    assert telemetry.metrics(1.5, Counters())["floor_viewpoints"] == 0


def test_silence_and_rejected_frames_are_reported() -> None:
    telemetry = MapperTelemetry()
    assert "no frame has arrived" in telemetry.problem(0.0)
    assert not telemetry.ready(0.0)
    telemetry = fed(GOOD)
    assert "no frame for" in telemetry.problem(SILENT_AFTER_S + 1)
    assert not telemetry.ready(SILENT_AFTER_S + 1)
    telemetry.record_rejected("another encoder")
    assert telemetry.problem(0.1) == "another encoder"
    assert not telemetry.ready(0.1)
    telemetry.record_fused(now_s=0.2, update_ms=1.0, depth=GOOD)
    assert telemetry.ready(0.3)
