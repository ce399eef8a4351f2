"""What perception says of itself, at given times."""

from __future__ import annotations

from onemap_perception.telemetry import PerceptionTelemetry


def problem(telemetry: PerceptionTelemetry, now_s: float) -> str:
    return telemetry.problem(now_s, silent_after_s=5.0, camera_key="robot/rgbd/v1")


def test_silence_is_told_with_its_length() -> None:
    telemetry = PerceptionTelemetry(started_s=10.0)
    assert problem(telemetry, 11.0) == "waiting for the first camera frame on robot/rgbd/v1"
    assert problem(telemetry, 13.2) == "no camera frames on robot/rgbd/v1 for 3.2 s"
    telemetry.frame_done(13.5, encode_ms=1.0, frame_age_ms=2.0)
    assert problem(telemetry, 14.0) == ""
    assert problem(telemetry, 20.0) == "no camera frames on robot/rgbd/v1 for 6.5 s"


def test_ready_for_as_long_as_frames_come() -> None:
    telemetry = PerceptionTelemetry(started_s=0.0)
    assert not telemetry.is_ready(0.1, 5.0)
    telemetry.frame_done(1.0, encode_ms=1.0, frame_age_ms=2.0)
    assert telemetry.is_ready(5.9, 5.0)
    assert not telemetry.is_ready(6.1, 5.0)


def test_the_rate_is_of_the_last_seconds() -> None:
    telemetry = PerceptionTelemetry(started_s=0.0)
    for step in range(100):
        telemetry.frame_done(step * 0.1, encode_ms=1.0, frame_age_ms=2.0)
    assert abs(telemetry.rate_hz(9.95) - 10.0) < 0.3
    assert telemetry.rate_hz(30.0) == 0.0


def test_a_failure_is_told_until_a_frame_succeeds() -> None:
    telemetry = PerceptionTelemetry(started_s=0.0)
    telemetry.frame_done(0.0, encode_ms=1.0, frame_age_ms=2.0)
    telemetry.frame_failed("out of memory", False)
    assert problem(telemetry, 0.1) == "frames cannot be encoded: out of memory"
    telemetry.frame_done(0.2, encode_ms=1.0, frame_age_ms=2.0)
    assert problem(telemetry, 0.3) == ""
    telemetry.text_problem = "'xyzzy' is unknown"
    assert problem(telemetry, 0.4) == "'xyzzy' is unknown"
