from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from queue import SimpleQueue
from typing import Any

import numpy as np
import pytest

from onemap_shared import frame_sender, keys
from onemap_shared.compression import CompressionError
from onemap_shared.config import LinkParams
from onemap_shared.frame_sender import FrameSender
from onemap_shared.messages import FrameReceipt, RgbdFrame
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


def test_a_bus_that_closes_under_a_frame_on_its_way_is_no_crash(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    crashes: list[object] = []
    monkeypatch.setattr(threading, "excepthook", crashes.append)
    monkeypatch.setattr(frame_sender, "CLOSING_S", 0.0)
    sending, closed = threading.Event(), threading.Event()

    def send(packet: Packet) -> None:
        sending.set()
        closed.wait(WAIT_S)
        raise OSError("the session is closed")

    sender = FrameSender(keys.ROBOT_RGBD, LinkParams(window=1), send)
    sender.put(frame(1))
    assert sending.wait(WAIT_S)
    sender.close()
    closed.set()
    sender._thread.join(WAIT_S)
    assert not sender._thread.is_alive()
    assert crashes == []


def test_a_broken_receipt_is_reported(opened: Opened, caplog: pytest.LogCaptureFixture) -> None:
    sender, _ = opened(LinkParams(window=1))
    sender.receipt(Packet(b"", b""))
    assert "a receipt of robot/rgbd/v1 is refused" in caplog.text


def test_jpeg_without_opencv_is_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> None:
        raise CompressionError("is a JPEG, which needs OpenCV")

    monkeypatch.setattr(frame_sender, "opencv", absent)
    with pytest.raises(CompressionError, match="needs OpenCV"):
        FrameSender(keys.ROBOT_RGBD, LinkParams(compression="lossy"), lambda packet: None)
