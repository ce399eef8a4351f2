from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from queue import SimpleQueue
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared import frame_sender, keys
from onemap_shared.compression import CompressionError
from onemap_shared.config import LinkParams
from onemap_shared.frame_sender import OVERDUE_S, FrameSender, SendWindow, compressions
from onemap_shared.messages import FeatureField, FrameReceipt, Odometry, RgbdFrame
from onemap_shared.wire import Packet, decode, encode
from tests.shared.samples import SAMPLES

FRAME = next(sample for sample in SAMPLES if isinstance(sample, RgbdFrame))
WAIT_S = 60.0
Opened = Callable[[LinkParams], tuple[FrameSender[RgbdFrame], "SimpleQueue[int]"]]


@pytest.fixture
def opened() -> Iterator[Opened]:
    """Opens a sender and the queue of the sequences that it puts on the wire."""
    senders: list[FrameSender[Any]] = []

    def open_sender(
        params: LinkParams,
    ) -> tuple[FrameSender[RgbdFrame], SimpleQueue[int]]:
        sent: SimpleQueue[int] = SimpleQueue()
        sender = FrameSender(
            keys.ROBOT_RGBD, params, lambda packet: sent.put(decode(RgbdFrame, packet).sequence)
        )
        senders.append(sender)
        return sender, sent

    yield open_sender
    for each in senders:
        each.close()


def receipt(sequence: int) -> Packet:
    return encode(FrameReceipt(sequence, 1))


def frame(sequence: int) -> RgbdFrame:
    return replace(FRAME, sequence=sequence)


def test_of_the_frames_that_wait_the_newest_is_sent(opened: Opened) -> None:
    sender, sent = opened(LinkParams(window=1))
    sender.put(frame(1))
    assert sent.get(timeout=WAIT_S) == 1
    sender.receipt(receipt(1))  # from now on frames wait for receipts
    sender.put(frame(2))
    assert sent.get(timeout=WAIT_S) == 2
    for number in (3, 4, 5):
        sender.put(frame(number))
    assert sent.empty()
    sender.receipt(receipt(2))
    assert sent.get(timeout=WAIT_S) == 5
    metrics = sender.metrics()
    assert metrics["link_rgbd_replaced"] == 2
    assert metrics["link_rgbd_overdue"] == 0


def test_a_lost_frame_does_not_stop_the_stream(
    opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_shared.frame_sender.OVERDUE_S", 0.05)
    sender, sent = opened(LinkParams(window=1))
    sender.put(frame(1))
    assert sent.get(timeout=WAIT_S) == 1
    sender.receipt(receipt(1))
    for number in (2, 3):  # of 2 no receipt comes
        sender.put(frame(number))
        assert sent.get(timeout=WAIT_S) == number
    assert sender.metrics()["link_rgbd_overdue"] == 1


def test_sent_bytes_are_counted() -> None:
    sizes: SimpleQueue[int] = SimpleQueue()
    image = replace(
        FRAME, rgb=np.zeros((60, 80, 3), np.uint8), depth_mm=np.full((60, 80), 900, np.uint16)
    )

    def send(packet: Packet) -> None:
        sizes.put(len(packet.header) + len(packet.body))

    params = LinkParams(compression="lossless")
    sender = FrameSender(keys.ROBOT_RGBD, params, send)
    sender.put(image)
    size = sizes.get(timeout=WAIT_S)
    assert size < 1000 < len(encode(image).body)
    sender.close()  # after it the thread has counted
    metrics = sender.metrics()
    assert metrics["link_rgbd_bytes"] == metrics["link_rgbd_frame_bytes"] == size
    assert metrics["link_rgbd_frames"] == 1


def test_jpeg_without_opencv_is_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> None:
        raise CompressionError("is a JPEG, which needs OpenCV")

    monkeypatch.setattr(frame_sender, "opencv", absent)
    with pytest.raises(CompressionError, match="needs OpenCV"):
        FrameSender(keys.ROBOT_RGBD, LinkParams(compression="lossy"), lambda packet: None)


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
