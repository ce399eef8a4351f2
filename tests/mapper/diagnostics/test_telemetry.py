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


def test_only_frames_that_were_fused_count_for_the_rate() -> None:
    telemetry = fed(*[GOOD] * 101)
    telemetry.record_rejected("another encoder")
    assert telemetry.rate_hz(20.0) == pytest.approx(5.0)
    assert telemetry.metrics(100.0, Counters())["rate_hz"] == 0


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


def test_a_cabinet_or_a_table_in_front_of_the_robot_is_no_problem() -> None:
    telemetry = fed(*turning(0.49)[:1] * 50)
    assert telemetry.problem(9.0) == ""
    metrics = telemetry.metrics(9.0, Counters())
    assert metrics["floor_viewpoints"] == 1
    assert not {"floor_height_m", "floor_wrong"} & metrics.keys()  # the floor is unknown


def test_one_tilted_frame_is_no_problem() -> None:
    tilted = DepthDiagnostics(0.9, 0.0, AHEAD, LevelSurface(-0.2, 0.1))
    telemetry = fed(GOOD, GOOD, tilted)
    assert telemetry.problem(1.0) == ""
    assert fed(GOOD, tilted, GOOD).metrics(1.0, Counters())["floor_wrong"] == 0


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


def test_metrics_hold_only_what_is_known() -> None:
    assert "floor_height_m" not in MapperTelemetry().metrics(0.0, Counters())
    metrics = fed(GOOD).metrics(0.1, Counters(received=3, missed=2, refused=1))
    assert metrics["frames_missed"] == 2
    assert metrics["frames_refused"] == 1
    assert metrics["depth_valid_fraction"] == 0.9
