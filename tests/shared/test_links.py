"""Frames and fields on thin links: codecs, windows and receipts."""

from __future__ import annotations

import builtins
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from queue import SimpleQueue
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from onemap_shared import frame_sender, keys, wire
from onemap_shared.clock import SystemClock
from onemap_shared.compression import Codec, CompressionError, decompress
from onemap_shared.config import LinkParams
from onemap_shared.frame_sender import OVERDUE_S, FrameSender, SendWindow
from onemap_shared.messages import FeatureField, FrameReceipt, RgbdFrame
from onemap_shared.messages.checks import jpeg_size_px
from onemap_shared.wire import Packet, WireError, decode, encode
from tests.shared.samples import SAMPLES

IMAGE = next(sample for sample in SAMPLES if isinstance(sample, RgbdFrame))
FIELD = next(sample for sample in SAMPLES if isinstance(sample, FeatureField))
LOSSLESS = Codec.DELTA
FRAME_CODECS = {"rgb": Codec.JPEG, "depth_mm": LOSSLESS}
FIELD_CODECS = {
    "features": Codec.INT8,
    "variance": Codec.LOG8,
    "depth_mm": LOSSLESS,
}
SIDES = st.integers(1, 12)


def there_and_back(codec: Codec, array: np.ndarray) -> np.ndarray:
    data = codec.compress(array)
    received = decompress(codec.value, data, array.dtype, array.shape)
    assert (received.dtype, received.shape) == (array.dtype, array.shape)
    assert not received.flags.writeable
    return received


@given(
    st.one_of(
        arrays.arrays(np.uint16, st.tuples(SIDES, SIDES)),
        arrays.arrays(np.uint8, st.tuples(SIDES, SIDES)),
        arrays.arrays(np.uint8, st.tuples(SIDES, SIDES, st.just(3))),
    )
)
def test_the_lossless_codec_loses_nothing(array: np.ndarray) -> None:
    np.testing.assert_array_equal(there_and_back(LOSSLESS, array), array)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 10.0))
def test_int8_features_keep_their_direction(seed: int, length: float) -> None:
    rng = np.random.default_rng(seed)
    features = (rng.standard_normal((3, 4, 64)) * length / 8).astype(np.float16)
    received = there_and_back(Codec.INT8, features).astype(np.float32)
    sent = features.astype(np.float32)
    cosine = (sent * received).sum(-1)
    cosine /= np.linalg.norm(sent, axis=-1) * np.linalg.norm(received, axis=-1)
    assert cosine.min() > 0.999
    assert np.abs(received - sent).max() <= np.abs(sent).max() / 127  # half a step, and rounding


def test_frames_and_fields_travel_compressed() -> None:
    pytest.importorskip("cv2", reason="JPEG needs OpenCV")
    frame = decode(RgbdFrame, encode(IMAGE, FRAME_CODECS))
    np.testing.assert_array_equal(frame.depth_mm, IMAGE.depth_mm)
    assert np.abs(frame.rgb.astype(int) - IMAGE.rgb).max() <= 4
    field = decode(FeatureField, encode(FIELD, FIELD_CODECS))
    np.testing.assert_allclose(field.features, FIELD.features, atol=0.01)
    np.testing.assert_allclose(field.variance, FIELD.variance, rtol=0.01)
    assert encode(IMAGE, {}) == encode(IMAGE)  # without a codec nothing changes


def with_description(packet: Packet, name: str, description: list[Any]) -> Packet:
    header = msgpack.unpackb(packet.header)
    header["arrays"][name] = description
    return Packet(msgpack.packb(header), packet.body)


SENT = encode(IMAGE, {"depth_mm": LOSSLESS})
DESCRIBED = msgpack.unpackb(SENT.header)["arrays"]["depth_mm"]
BOMB = zlib.compress(bytes(10_000_000))
BAD: dict[str, tuple[Packet, str]] = {
    "another codec": (
        with_description(SENT, "depth_mm", [*DESCRIBED[:3], "zstd", DESCRIBED[4]]),
        "array depth_mm is compressed as 'zstd', which this release cannot read .*delta-zlib",
    ),
    "beyond the body": (
        with_description(SENT, "depth_mm", [*DESCRIBED[:4], 10**6]),
        "needs bytes",
    ),
    "negative size": (with_description(SENT, "depth_mm", [*DESCRIBED[:4], -1]), "needs bytes"),
    "cut off": (with_description(SENT, "depth_mm", [*DESCRIBED[:4], 9]), "does not unpack"),
    "no zlib": (with_description(SENT, "depth_mm", [*DESCRIBED[:2], 3, *DESCRIBED[3:]]), "zlib"),
    "larger than announced": (
        Packet(
            with_description(SENT, "depth_mm", [*DESCRIBED[:2], 0, "delta-zlib", len(BOMB)]).header,
            BOMB,
        ),
        "does not unpack to its 96 bytes",
    ),
    "more than a body may hold": (
        with_description(SENT, "depth_mm", ["<u2", [2**20, 2**20], *DESCRIBED[2:]]),
        f"more than {wire.MAX_BODY_BYTES}",
    ),
    "of a type it is not for": (
        with_description(SENT, "depth_mm", [*DESCRIBED[:3], "int8", DESCRIBED[4]]),
        "uint16 .* cannot be compressed as 'int8'",
    ),
    "codec is no text": (
        with_description(SENT, "depth_mm", [*DESCRIBED[:3], 7, DESCRIBED[4]]),
        "not described",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_compressed_arrays_are_refused_with_the_reason(case: str) -> None:
    packet, reason = BAD[case]
    with pytest.raises(WireError, match=reason):
        decode(RgbdFrame, packet)


@given(st.binary(max_size=60))
def test_no_bytes_crash_a_receiver(data: bytes) -> None:
    for codec, dtype, shape in (
        ("int8", "<f2", (1, 2, 3)),
        ("log8", "<f4", (2, 3)),
        ("delta-zlib", "<u2", (2, 3)),
        ("jpeg", "|u1", (2, 3, 3)),
    ):
        try:
            received = decompress(codec, data, np.dtype(dtype), shape)
        except CompressionError:
            continue
        assert received.shape == shape


def test_a_jpeg_of_another_size_is_refused_before_it_is_unpacked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("cv2", reason="JPEG needs OpenCV")
    data = Codec.JPEG.compress(np.zeros((64, 96, 3), np.uint8))
    assert jpeg_size_px(data) == (96, 64)
    monkeypatch.setattr("onemap_shared.compression.opencv", None)  # not even asked for
    with pytest.raises(CompressionError, match=r"announces \(8, 6\) pixels, its JPEG holds"):
        decompress("jpeg", data, np.dtype("|u1"), (6, 8, 3))


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
            keys.ROBOT_RGBD,
            params,
            lambda packet: sent.put(decode(RgbdFrame, packet).sequence),
            SystemClock(),
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


def test_jpeg_without_opencv_is_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> None:
        raise CompressionError("is a JPEG, which needs OpenCV")

    monkeypatch.setattr(frame_sender, "opencv", absent)
    with pytest.raises(CompressionError, match="needs OpenCV"):
        FrameSender(
            keys.ROBOT_RGBD, LinkParams(compression="lossy"), lambda packet: None, SystemClock()
        )


def heard(size: int) -> SendWindow:
    """A window whose receiver sends receipts."""
    return SendWindow(size).with_sent(0, 0.0).with_receipt(0, 0.1)


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


def test_without_opencv_a_jpeg_is_refused_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cv2", reason="JPEG needs OpenCV")
    data = Codec.JPEG.compress(np.zeros((6, 8, 3), np.uint8))
    real = builtins.__import__

    def absent(name: str, *arguments: Any, **options: Any) -> Any:
        if name == "cv2":
            raise ImportError(name)
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(CompressionError, match=r"set bus\.link\.compression to lossless"):
        decompress("jpeg", data, np.dtype("|u1"), (6, 8, 3))
