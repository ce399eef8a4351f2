from __future__ import annotations

import builtins
import zlib
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from onemap_shared import wire
from onemap_shared.compression import Codec, Compression, CompressionError, decompress
from onemap_shared.messages import FeatureField, RgbdFrame
from onemap_shared.messages.checks import jpeg_size_px
from onemap_shared.wire import Packet, WireError, decode, encode
from tests.shared.samples import SAMPLES

FRAME = next(sample for sample in SAMPLES if isinstance(sample, RgbdFrame))
FIELD = next(sample for sample in SAMPLES if isinstance(sample, FeatureField))
LOSSLESS = Compression(Codec.DELTA)
FRAME_CODECS = {"rgb": Compression(Codec.JPEG), "depth_mm": LOSSLESS}
FIELD_CODECS = {
    "features": Compression(Codec.INT8),
    "variance": Compression(Codec.LOG8),
    "depth_mm": LOSSLESS,
}
SIDES = st.integers(1, 12)


def there_and_back(compression: Compression, array: np.ndarray) -> np.ndarray:
    data = compression.compress(array)
    received = decompress(compression.codec.value, data, array.dtype, array.shape)
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
    received = there_and_back(Compression(Codec.INT8), features).astype(np.float32)
    sent = features.astype(np.float32)
    cosine = (sent * received).sum(-1)
    cosine /= np.linalg.norm(sent, axis=-1) * np.linalg.norm(received, axis=-1)
    assert cosine.min() > 0.999
    assert np.abs(received - sent).max() <= np.abs(sent).max() / 127  # half a step, and rounding


def test_frames_and_fields_travel_compressed() -> None:
    pytest.importorskip("cv2", reason="JPEG needs OpenCV")
    frame = decode(RgbdFrame, encode(FRAME, FRAME_CODECS))
    np.testing.assert_array_equal(frame.depth_mm, FRAME.depth_mm)
    assert np.abs(frame.rgb.astype(int) - FRAME.rgb).max() <= 4
    field = decode(FeatureField, encode(FIELD, FIELD_CODECS))
    np.testing.assert_allclose(field.features, FIELD.features, atol=0.01)
    np.testing.assert_allclose(field.variance, FIELD.variance, rtol=0.01)
    assert encode(FRAME, {}) == encode(FRAME)  # without a codec nothing changes


def with_description(packet: Packet, name: str, description: list[Any]) -> Packet:
    header = msgpack.unpackb(packet.header)
    header["arrays"][name] = description
    return Packet(msgpack.packb(header), packet.body)


SENT = encode(FRAME, {"depth_mm": LOSSLESS})
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
    data = Compression(Codec.JPEG).compress(np.zeros((64, 96, 3), np.uint8))
    assert jpeg_size_px(data) == (96, 64)
    monkeypatch.setattr("onemap_shared.compression.opencv", None)  # not even asked for
    with pytest.raises(CompressionError, match=r"announces \(8, 6\) pixels, its JPEG holds"):
        decompress("jpeg", data, np.dtype("|u1"), (6, 8, 3))


def test_without_opencv_a_jpeg_is_refused_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cv2", reason="JPEG needs OpenCV")
    data = Compression(Codec.JPEG).compress(np.zeros((6, 8, 3), np.uint8))
    real = builtins.__import__

    def absent(name: str, *arguments: Any, **options: Any) -> Any:
        if name == "cv2":
            raise ImportError(name)
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(CompressionError, match=r"set bus\.link\.compression to lossless"):
        decompress("jpeg", data, np.dtype("|u1"), (6, 8, 3))
