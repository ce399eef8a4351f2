"""The detector runs after the encoder, or at the same time in a thread of its own."""

from __future__ import annotations

import time
from itertools import count

import pytest

from onemap_perception.detector_runner import DetectionResult, DetectorRunner
from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import DetectorError
from onemap_perception.target_detection import make_target
from tests.perception.slow_detector import SlowDetector
from tests.perception.toy import ColourEncoder, frame

ENCODER = ColourEncoder()
RED, BLUE = make_target(ENCODER, "red", ()), make_target(ENCODER, "blue", ())
FRAME = frame(1)
FEATURES = ENCODER.encode(FRAME.rgb)


def finished(runner: DetectorRunner) -> DetectionResult:
    for _ in range(6000):
        result = runner.collect()
        if result is not None:
            return result
        time.sleep(0.01)
    raise AssertionError("the detector did not finish")


def test_a_detector_that_reads_features_runs_after_the_encoder() -> None:
    clock = count(1.0, 0.25)
    runner = DetectorRunner(PatchDetector("toy"), lambda: next(clock))
    runner.before_encoding(FRAME, RED)
    assert runner.collect() is None
    result = runner.after_encoding(FRAME, FEATURES, RED)
    assert result is not None
    assert (result.target, result.detections.names, result.detect_ms) == (RED, ("red",), 250.0)
    runner.close()


def test_a_busy_detector_skips_frames_and_ends_the_first() -> None:
    detector = SlowDetector()
    runner = DetectorRunner(detector, time.perf_counter)
    runner.before_encoding(FRAME, RED)
    runner.before_encoding(frame(2), BLUE)
    assert runner.after_encoding(frame(2), FEATURES, BLUE) is None
    assert runner.skipped == 1
    detector.finish.set()
    result = finished(runner)
    assert result.target is RED
    assert (result.detections.sequence, result.detections.names) == (1, ("red",))
    assert runner.collect() is None
    runner.close()


def test_an_error_of_the_thread_is_raised_once() -> None:
    detector = SlowDetector()
    detector.broken = True
    detector.finish.set()
    runner = DetectorRunner(detector, time.perf_counter)
    runner.before_encoding(FRAME, RED)
    with pytest.raises(DetectorError, match="the weights are damaged"):
        finished(runner)
    assert runner.collect() is None
    runner.close()
