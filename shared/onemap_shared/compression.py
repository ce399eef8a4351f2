"""Arrays of frames and fields as fewer bytes, for links that are slower than loopback.

Each codec is named in the header of the packet that it was used for, so that a receiver knows
without settings of its own what to do. The lossless one and those for features and variances need
numpy and zlib alone; JPEG needs OpenCV on both sides.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from enum import Enum
from math import prod
from typing import Any, NamedTuple

import numpy as np

from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages.checks import jpeg_size_px

# With 95 the best places of a query stay so in 93 of 100 cases, with 80 in 87.
JPEG_QUALITY = 95
LOG_STEPS = 254  # codes 1 to 255 of a variance; 0 is infinity
LOG_RANGE = struct.Struct("<2f")


class CompressionError(ValueError):
    """Bytes that are not what their codec makes, or a codec that cannot be used here."""


class Codec(str, Enum):
    """How an array is compressed, as the header of its packet names it."""

    DELTA = "delta-zlib"  # lossless, of uint8 and uint16
    JPEG = "jpeg"  # of colour images
    INT8 = "int8"  # of features: one scale for each patch
    LOG8 = "log8"  # of variances: 254 steps of their logarithm

    def compress(self, array: np.ndarray) -> bytes:
        """The bytes of an array that ``decompress`` takes."""
        return FORMATS[self].pack(array)


def decompress(codec: str, data: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """The array (shape, dtype) of compressed bytes; raises CompressionError with the reason.

    Nothing larger than the announced array is ever unpacked.
    """
    known = tuple(each.value for each in Codec)
    if codec not in known:
        raise CompressionError(
            f"is compressed as {codec!r}, which this release cannot read (it reads "
            f"{', '.join(known)}): update the receiver, or change bus.link at the sender"
        )
    wanted, axes, _, unpack = FORMATS[Codec(codec)]
    if dtype.str not in wanted or len(shape) not in axes or (codec == Codec.JPEG and shape[2] != 3):
        raise CompressionError(f"of {dtype} {shape} cannot be compressed as {codec!r}")
    array = unpack(data, dtype, shape)
    array.flags.writeable = False
    return array


def _delta(array: np.ndarray) -> bytes:
    """Differences to the left neighbour, modulo the type's range; of 16 bits as two planes."""
    difference = np.diff(array, axis=1, prepend=array.dtype.type(0))
    if array.dtype.itemsize == 1:
        return _deflate(difference.tobytes())
    signed = difference.view(np.int16)
    folded = ((signed << 1) ^ (signed >> 15)).astype("<i2")
    return _deflate(folded.reshape(-1).view(np.uint8).reshape(-1, 2).T.tobytes())


def _undelta(data: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    raw = np.frombuffer(_inflate(data, prod(shape) * dtype.itemsize), np.uint8)
    if dtype.itemsize == 1:
        difference = raw.reshape(shape)
    else:
        folded = np.ascontiguousarray(raw.reshape(2, -1).T).reshape(-1).view("<u2")
        difference = ((folded >> 1) ^ (0 - (folded & 1))).astype(dtype).reshape(shape)
    array: np.ndarray = np.cumsum(difference, axis=1, dtype=dtype)
    return array


def _int8(features: F16) -> bytes:
    """A float32 scale for each patch, then its channels as multiples of it, -127 to 127."""
    wide = features.astype(np.float32)
    scale = np.abs(wide).max(axis=-1, keepdims=True) / np.float32(127)
    steps = np.rint(wide / np.where(scale > 0, scale, np.float32(1))).astype(np.int8)
    scales: bytes = scale.astype("<f4").tobytes()
    return scales + _delta(steps.view(np.uint8))


def _unint8(data: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    size = prod(shape[:2]) * 4
    if len(data) < size:
        raise CompressionError(f"has {len(data)} bytes; its scales alone take {size}")
    scale = np.frombuffer(data[:size], "<f4").reshape(*shape[:2], 1)
    steps = _undelta(data[size:], np.dtype(np.uint8), shape).view(np.int8)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite, the message refuses
        array: np.ndarray = (steps * scale).astype(dtype)
    return array


def _log8(variance: F32) -> bytes:
    """Lowest logarithm (base 2) and step, then a step's number for each pixel, 0 for infinity."""
    finite = np.isfinite(variance)
    logarithm = np.log2(variance, where=finite, out=np.zeros_like(variance))
    low, high = (float(of(logarithm[finite])) if finite.any() else 0.0 for of in (np.min, np.max))
    step = max((high - low) / LOG_STEPS, 1e-6)
    number = np.where(finite, np.rint((logarithm - low) / step) + 1, 0)
    codes = np.clip(number, 0, LOG_STEPS + 1).astype(np.uint8)
    return LOG_RANGE.pack(low, step) + _delta(codes)


def _unlog8(data: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    if len(data) < LOG_RANGE.size:
        raise CompressionError(f"has {len(data)} bytes; its range alone takes {LOG_RANGE.size}")
    low, step = LOG_RANGE.unpack(data[: LOG_RANGE.size])
    codes = _undelta(data[LOG_RANGE.size :], np.dtype(np.uint8), shape)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not positive, the message refuses
        values = np.exp2(np.float32(low) + np.arange(LOG_STEPS + 1, dtype=np.float32) * step)
    table = np.concatenate([[np.inf], values]).astype(dtype)
    array: np.ndarray = table[codes]
    return array


def _jpeg(rgb: U8) -> bytes:
    cv2 = opencv()
    made, data = cv2.imencode(
        ".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    )
    if not made:
        raise CompressionError(f"OpenCV cannot write an image of {rgb.shape} as JPEG")
    return bytes(data)


def _unjpeg(data: bytes, _dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    size = jpeg_size_px(data)
    if size is None or size[::-1] != shape[:2]:  # before a large image is unpacked
        raise CompressionError(f"announces {shape[1::-1]} pixels, its JPEG holds {size}")
    cv2 = opencv()
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    if image is None or image.shape != shape:
        raise CompressionError("is no JPEG that OpenCV can read")
    array: np.ndarray = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    return array


def opencv() -> Any:
    """OpenCV, or CompressionError with what to install."""
    try:
        import cv2
    except ImportError as problem:
        raise CompressionError(
            "is a JPEG, which needs OpenCV here (pip install opencv-python-headless): install it, "
            "or set bus.link.compression to lossless at the sender"
        ) from problem
    return cv2


def _deflate(data: bytes) -> bytes:
    # Run lengths alone: of differences as small as a full search, in half the time.
    packer = zlib.compressobj(1, zlib.DEFLATED, zlib.MAX_WBITS, zlib.DEF_MEM_LEVEL, zlib.Z_RLE)
    return packer.compress(data) + packer.flush()


def _inflate(data: bytes, size: int) -> bytes:
    """Exactly ``size`` bytes."""
    unpacker = zlib.decompressobj()
    try:
        raw = unpacker.decompress(data, size) if size else b""
    except zlib.error as problem:
        raise CompressionError(f"is no zlib stream: {problem}") from problem
    if len(raw) != size or (size and unpacker.unconsumed_tail):
        raise CompressionError(f"does not unpack to its {size} bytes")
    return raw


class _Format(NamedTuple):
    """What a codec takes, and how: dtypes and numbers of axes, to bytes and back."""

    dtypes: tuple[str, ...]
    axes: tuple[int, ...]
    pack: Callable[[np.ndarray], bytes]
    unpack: Callable[[bytes, np.dtype, tuple[int, ...]], np.ndarray]


FORMATS: Mapping[Codec, _Format] = {
    Codec.DELTA: _Format(("|u1", "<u2"), (2, 3), _delta, _undelta),
    Codec.JPEG: _Format(("|u1",), (3,), _jpeg, _unjpeg),
    Codec.INT8: _Format(("<f2",), (3,), _int8, _unint8),
    Codec.LOG8: _Format(("<f4",), (2,), _log8, _unlog8),
}
