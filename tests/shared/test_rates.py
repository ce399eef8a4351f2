from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.rates import WINDOW_S, RateMeter


def metered(times_s: list[float]) -> RateMeter:
    meter = RateMeter()
    for at in times_s:
        meter = meter.with_event(at)
    return meter


@given(st.floats(0.5, 100), st.integers(4, 300))
def test_a_steady_stream_has_its_rate_at_and_between_events(rate_hz: float, count: int) -> None:
    times = [k / rate_hz for k in range(count)]
    meter = metered(times)
    assert meter.rate_hz(times[-1]) == pytest.approx(rate_hz, rel=1e-6)
    assert meter.rate_hz(times[-1] + 0.5 / rate_hz) == pytest.approx(rate_hz, rel=0.2)


def test_a_stalled_stream_s_rate_falls_to_nothing() -> None:
    meter = metered([k / 10 for k in range(51)])
    rates = [meter.rate_hz(5.0 + stall) for stall in (0.0, 1.0, 3.0, WINDOW_S + 0.1)]
    assert rates == sorted(rates, reverse=True)
    assert rates[0] == pytest.approx(10.0)
    assert rates[-1] == 0.0


def test_silence_is_counted_from_the_newest_event_or_the_start() -> None:
    assert RateMeter().silent_s(4.0, since_s=1.0) == 3.0
    assert metered([0.0, 2.0]).silent_s(100.0, since_s=0.0) == 98.0
