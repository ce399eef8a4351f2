"""Latencies of frames, at given times."""

from __future__ import annotations

import pytest

from onemap_gateway.bus.live_state import (
    BOUNDS_S,
    KEPT_FRAMES,
    RECENT,
    FrameLatencies,
    LatencyHistogram,
)


@pytest.mark.parametrize(("latency_s", "index"), [(0.0, 0), (0.02, 0), (0.021, 1), (9.0, -1)])
def test_a_latency_is_counted_up_to_its_bound(latency_s: float, index: int) -> None:
    histogram = LatencyHistogram().with_value(latency_s)
    assert histogram.counts[index] == sum(histogram.counts) == 1
    assert len(histogram.counts) == len(BOUNDS_S) + 1
    assert histogram.total_s == latency_s


def test_quantiles_are_latencies_that_were_measured() -> None:
    histogram = LatencyHistogram()
    for hundredth in range(1, 101):
        histogram = histogram.with_value(hundredth / 100)
    assert (histogram.quantile_s(0.5), histogram.quantile_s(0.95)) == (0.5, 0.95)
    assert (histogram.quantile_s(0.0), histogram.quantile_s(1.0)) == (0.01, 1.0)


def test_quantiles_are_of_late_and_zero_of_nothing() -> None:
    histogram = LatencyHistogram()
    assert histogram.quantile_s(0.95) == 0.0
    for latency_s in (*[9.0] * 50, *[0.1] * RECENT):
        histogram = histogram.with_value(latency_s)
    assert histogram.quantile_s(1.0) == 0.1
    assert sum(histogram.counts) == RECENT + 50


def test_each_stage_is_timed_from_the_frame_once() -> None:
    seen = FrameLatencies().with_frame(7, 1.0).with_frame(8, 1.1)
    seen = seen.with_result("map", 7, 1.25).with_result("detections", 7, 1.5)
    assert seen.stages["map"].total_s == 0.25
    assert seen.stages["detections"].total_s == 0.5
    assert seen.with_result("map", 7, 9.0) is seen


def test_a_frame_that_is_not_known_is_not_timed() -> None:
    seen = FrameLatencies().with_frame(7, 1.0)
    assert seen.with_result("map", 6, 1.1) is seen
    for stamp_ns in range(8, 8 + KEPT_FRAMES):
        seen = seen.with_frame(stamp_ns, 1.0)
    assert len(seen.arrivals) == KEPT_FRAMES
    assert seen.with_result("map", 7, 1.1) is seen
