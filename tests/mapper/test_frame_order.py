"""Late frames are told by their sequence, so that a clock may be set back."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.robots import (
    NEW_STREAM_FRAMES,
    SAME_PLACE_M,
    FrameOrder,
    FrameStamp,
    OriginCheck,
)

S = 10**9
NEWEST = FrameStamp(50, 100 * S)


@pytest.mark.parametrize(
    ("frame", "late"),
    [
        (FrameStamp(51, 101 * S), False),
        (FrameStamp(49, 99 * S), True),
        (FrameStamp(51, 91 * S), False),  # the clock was set back by 9 s
        (FrameStamp(0, 101 * S), False),  # the robot was started again
        (FrameStamp(0, 40 * S), False),  # another recording
        (FrameStamp(50, 100 * S), False),  # a recording of one frame, repeated
    ],
)
def test_a_frame_is_late_by_sequence_and_time(frame: FrameStamp, late: bool) -> None:
    assert FrameOrder().is_late(frame, NEWEST) is late


def test_a_robot_that_counts_anew_on_a_clock_set_back_is_soon_followed() -> None:
    order = FrameOrder()
    restarted = [FrameStamp(k, 95 * S + k) for k in range(NEW_STREAM_FRAMES)]
    seen = [order.is_late(frame, NEWEST) for frame in restarted]
    assert seen == [True] * (NEW_STREAM_FRAMES - 1) + [False]


def test_single_late_frames_between_others_are_no_new_stream() -> None:
    order = FrameOrder()
    for k in range(5):
        newest = FrameStamp(50 + k, (100 + k) * S)
        assert order.is_late(FrameStamp(48 + k, (98 + k) * S), newest)
        assert not order.is_late(FrameStamp(51 + k, (101 + k) * S), newest)
    backwards = [order.is_late(FrameStamp(40 - k, 95 * S), NEWEST) for k in range(5)]
    assert all(backwards)


THERE, HERE = np.array([3.0, 4.0, 1.0]), np.array([0.0, 0.0, 1.0])


def test_a_robot_that_counts_anew_elsewhere_is_told_until_it_is_back_or_the_map_is_new() -> None:
    origin = OriginCheck()
    origin.distance_m(50, THERE, None)
    assert [origin.distance_m(k, HERE, THERE) for k in range(3)] == [5, 5, 5]
    assert origin.distance_m(3, THERE, THERE) == 5  # drove there in a frame of its own
    assert origin.distance_m(0, THERE + 0.9 * SAME_PLACE_M / np.sqrt(3), THERE) == 0
    assert origin.distance_m(0, HERE, THERE) == 0  # a frame repeated, not a count anew
    origin.distance_m(9, THERE, THERE)
    assert origin.distance_m(0, HERE, THERE) == 5
    assert origin.distance_m(1, HERE, None) == 0
