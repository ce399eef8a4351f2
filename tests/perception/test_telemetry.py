"""Readiness and problems of perception, at given times."""

from __future__ import annotations

from onemap_perception.telemetry import PerceptionTelemetry


def problem(telemetry: PerceptionTelemetry, now_s: float) -> str:
    return telemetry.problem(now_s, "robot/rgbd/v1")


def test_the_time_without_frames_is_stated() -> None:
    telemetry = PerceptionTelemetry(started_s=10.0)
    assert problem(telemetry, 11.0) == "waiting for the first camera frame on robot/rgbd/v1"
    assert problem(telemetry, 13.2) == "no camera frames on robot/rgbd/v1 for 3.2 s"
    telemetry.frame_done(13.5, encode_ms=1.0, frame_age_ms=2.0)
    assert problem(telemetry, 14.0) == ""
    assert problem(telemetry, 20.0) == "no camera frames on robot/rgbd/v1 for 6.5 s"


def test_a_failing_detector_is_a_problem_but_not_of_readiness() -> None:
    telemetry = PerceptionTelemetry(started_s=0.0)
    assert telemetry.timings == {}
    telemetry.frame_done(0.0, encode_ms=1.0, frame_age_ms=2.0)
    telemetry.detection_failed("no memory", out_of_memory=True)
    assert problem(telemetry, 0.1) == "nothing can be detected: no memory"
    assert telemetry.is_ready(0.1)
    assert (telemetry.detections_failed, telemetry.out_of_memory) == (1, 1)
    telemetry.detection_done(3.0)
    assert problem(telemetry, 0.2) == ""
    assert telemetry.timings == {"encode_ms": 1.0, "detect_ms": 3.0, "frame_age_ms": 2.0}
