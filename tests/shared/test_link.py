from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.frame_sender import OVERDUE_S, SendWindow, compressions
from onemap_shared.messages import FeatureField, Odometry, RgbdFrame

NEVER = float("-inf")


def heard(size: int) -> SendWindow:
    """A window whose receiver sends receipts."""
    return SendWindow(size).with_sent(0, 0.0).with_receipt(0, 0.1)


@pytest.mark.parametrize(
    ("how", "frame", "field"),
    [
        ("none", {}, {}),
        ("lossless", {"rgb": "DELTA", "depth_mm": "DELTA"}, {"depth_mm": "DELTA"}),
        (
            "lossy",
            {"rgb": "JPEG", "depth_mm": "DELTA"},
            {"features": "INT8", "variance": "LOG8", "depth_mm": "DELTA"},
        ),
    ],
)
def test_every_large_array_has_its_codec(
    how: str, frame: dict[str, str], field: dict[str, str]
) -> None:
    for message, expected in ((RgbdFrame, frame), (FeatureField, field), (Odometry, {})):
        chosen = compressions(message, how)
        assert {name: each.codec.name for name, each in chosen.items()} == expected


def test_a_full_window_waits_for_a_receipt() -> None:
    window = heard(2).with_sent(1, 1.0)
    assert window.free_at() == NEVER
    window = window.with_sent(2, 1.1)
    assert window.free_at() == 1.0 + OVERDUE_S
    window = window.with_receipt(1, 1.25)
    assert window.free_at() == NEVER
    assert window.answer_s == pytest.approx(0.25)


def test_a_receipt_counts_for_the_skipped_frames_before_it() -> None:
    window = heard(2).with_sent(1, 1.0).with_sent(2, 1.1).with_receipt(2, 1.3)
    assert window.under_way == ()
    assert window.overdue == 0


def test_lost_frames_are_given_up_and_counted() -> None:
    window = heard(1).with_sent(1, 1.0)
    assert window.free_at() == 1.0 + OVERDUE_S
    window = window.with_sent(2, 1.0 + OVERDUE_S)
    assert window.overdue == 1
    assert [sequence for sequence, _ in window.under_way] == [2]


@given(st.integers(1, 4), st.lists(st.tuples(st.booleans(), st.floats(0.01, 2.0)), max_size=40))
def test_never_are_more_frames_under_way_than_the_window(
    size: int, events: list[tuple[bool, float]]
) -> None:
    window, now_s, number = heard(size), 1.0, 0
    for wants_to_send, pause_s in events:
        now_s += pause_s
        if wants_to_send and window.free_at() <= now_s:
            number += 1
            window = window.with_sent(number, now_s)
        elif window.under_way:
            window = window.with_receipt(window.under_way[0][0], now_s)
        assert len([at for _, at in window.under_way if now_s - at < OVERDUE_S]) <= size
