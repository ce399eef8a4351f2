from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.errors.frame_link import FrameLink, FrameLinkParams


def link(**values: float) -> FrameLink[int]:
    return FrameLink(FrameLinkParams(**values), np.random.default_rng(4))


def test_without_errors_a_frame_arrives_at_once() -> None:
    plain = link()
    plain.send(1, 10.0)
    assert plain.next_s() == 10.0
    assert plain.arrived(10.0) == [1]
    assert plain.arrived(11.0) == []
    assert plain.next_s() is None


def test_late_frames_arrive_in_their_order_within_the_limits() -> None:
    late = link(min_delay_s=0.1, max_delay_s=0.6)
    arrivals: dict[int, float] = {}
    for tick in range(2200):
        now_s = tick / 100
        if tick % 25 == 0 and tick < 2000:
            late.send(tick // 25, now_s)
        arrivals.update(dict.fromkeys(late.arrived(now_s), now_s))
    assert list(arrivals) == list(range(80))
    delays = np.array([arrivals[k] - k / 4 for k in range(80)])
    assert delays.min() >= 0.1
    assert delays.max() <= 0.62
    assert delays.std() > 0.05
    assert late.lost == 0


def test_frames_are_lost_as_often_and_in_bursts_as_long_as_set() -> None:
    losing = link(lost_share=0.2, lost_in_a_row=4.0)
    for k in range(20000):
        losing.send(k, float(k))
    kept = losing.arrived(20000.0)
    assert losing.lost == 20000 - len(kept)
    assert losing.lost / 20000 == pytest.approx(0.2, abs=0.03)
    gaps = np.diff(kept) - 1
    assert gaps[gaps > 0].mean() == pytest.approx(4.0, rel=0.15)


def test_limits_in_the_wrong_order_mean_the_same() -> None:
    late = link(min_delay_s=0.6, max_delay_s=0.1)
    late.send(1, 0.0)
    arrival_s = late.next_s()
    assert arrival_s is not None
    assert 0.1 <= arrival_s <= 0.6
