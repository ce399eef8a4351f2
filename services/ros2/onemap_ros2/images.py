"""ROS 2 images and camera information as the arrays that a frame is made of."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from onemap_ros2.cdr import FormatError
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, U8, U16

CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1, "8UC1": 1, "8UC3": 3}
REVERSED = ("bgr8", "bgra8", "8UC3")  # OpenCV's order
MM_PER_M = 1000.0
DEPTH_HEADER = struct.Struct("<iff")  # of compressedDepth: format, A, B
MAX_DEPTH_MM = np.iinfo(np.uint16).max


def rows(image: Any, dtype: str, channels: int) -> NDArray:
    """(H, W, channels) of a ``sensor_msgs/Image``: honours ``step`` and ``is_bigendian``."""
    item = np.dtype(dtype).newbyteorder(">" if image.is_bigendian else "<")
    height, width, step = int(image.height), int(image.width), int(image.step)
    used = width * channels * item.itemsize
    if height < 1 or width < 1 or step < used or len(image.data) < height * step:
        raise FormatError(
            f"an image of {width} x {height} pixels {image.encoding} has {len(image.data)} bytes "
            f"in rows of {step}; it needs rows of at least {used} bytes"
        )
    data = np.asarray(image.data, np.uint8)[: height * step].reshape(height, step)[:, :used]
    pixels: NDArray = np.ascontiguousarray(data).view(item)
    return pixels.reshape(height, width, channels)


def color_image(image: Any) -> U8:
    """(H, W, 3) uint8 red, green, blue of a ``sensor_msgs/Image``."""
    channels = CHANNELS.get(image.encoding)
    if channels is None:
        raise FormatError(
            f"the color image's encoding {image.encoding!r} is not supported; supported are "
            f"{', '.join(CHANNELS)}"
        )
    pixels = rows(image, "u1", channels)
    if channels == 1:
        return np.repeat(pixels, 3, axis=2)
    rgb: U8 = pixels[..., 2::-1] if image.encoding in REVERSED else pixels[..., :3]
    return rgb


def depth_image_mm(image: Any) -> U16:
    """(H, W) uint16 millimetres, 0 = no return, of ``16UC1`` (mm) or ``32FC1`` (m)."""
    if image.encoding in ("16UC1", "mono16"):
        millimetres: U16 = rows(image, "u2", 1)[..., 0].astype(np.uint16, copy=False)
        return millimetres
    if image.encoding != "32FC1":
        raise FormatError(
            f"the depth image's encoding {image.encoding!r} is not supported; supported are "
            "16UC1 (millimetres) and 32FC1 (metres)"
        )
    return _millimetres(rows(image, "f4", 1)[..., 0].astype(np.float32, copy=False))


def _millimetres(metres: F32) -> U16:
    """Rounded; 0 for what is invalid: NaN, infinite, under half a millimetre, over 65 m."""
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = np.rint(metres * MM_PER_M)
        measured = (scaled >= 1) & (scaled <= MAX_DEPTH_MM)  # False for NaN
    return np.where(measured, scaled, 0).astype(np.uint16)


def compressed_color(image: Any) -> U8:
    """(H, W, 3) uint8 red, green, blue of a ``sensor_msgs/CompressedImage``: JPEG or PNG."""
    bgr = _decompressed(image.data, cv2.IMREAD_COLOR, image.format)
    rgb: U8 = bgr[..., ::-1]
    return rgb


def compressed_depth_mm(image: Any) -> U16:
    """(H, W) uint16 millimetres of a ``CompressedImage`` of image_transport.

    Its format says how: "16UC1; compressedDepth" and "32FC1; compressedDepth png" have a header of
    12 bytes before the PNG, "16UC1; png compressed" has none. Values of 32FC1 are inverse: A / (raw
    - B) metres. RVL is refused.
    """
    parts = str(image.format).split(";")
    encoding, how = parts[0].strip(), "".join(parts[1:]).lower()
    if "rvl" in how or encoding not in ("16UC1", "32FC1"):
        raise FormatError(
            f"the depth image's format {image.format!r} is not supported; supported are 16UC1 and "
            "32FC1 with PNG: set the publisher's parameter compressedDepth.format to png"
        )
    if "compresseddepth" not in how:
        return _png_depth(image.data, image.format)
    if len(image.data) <= DEPTH_HEADER.size:
        raise FormatError(f"a depth image of {len(image.data)} bytes has no room for its header")
    _, scale, offset = DEPTH_HEADER.unpack_from(bytes(image.data[: DEPTH_HEADER.size]))
    raw = _png_depth(image.data[DEPTH_HEADER.size :], image.format)
    if encoding == "16UC1":
        return raw
    inverse = raw.astype(np.float32) - np.float32(offset)
    measured = (raw > 0) & (inverse > 0)
    metres = np.zeros(raw.shape, np.float32)
    np.divide(np.float32(scale), inverse, out=metres, where=measured)
    return _millimetres(metres)


def _png_depth(data: Any, name: str) -> U16:
    raw = _decompressed(data, cv2.IMREAD_UNCHANGED, name)
    if raw.dtype != np.uint16 or raw.ndim != 2:
        raise FormatError(
            f"the depth image {name!r} holds {raw.dtype} of shape {raw.shape}; it must be a PNG "
            "of 16 bits with one channel"
        )
    return raw


def _decompressed(data: Any, mode: int, name: str) -> NDArray:
    try:
        pixels: NDArray | None = cv2.imdecode(np.asarray(data, np.uint8), mode)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise FormatError(f"an image of format {name!r} and {len(data)} bytes is no JPEG or PNG")
    return pixels


@dataclass(frozen=True, slots=True)
class CalibratedCamera:
    """What a ``sensor_msgs/CameraInfo`` says: width and height in pixels, and their camera."""

    size: tuple[int, int]
    camera: Intrinsics

    def of_image(self, width: int, height: int) -> Intrinsics:
        """The camera of an image of this size, binned or resized; FormatError: another aspect."""
        across, down = width / self.size[0], height / self.size[1]
        off_px = max(abs(height - self.size[1] * across), abs(width - self.size[0] * down))
        if off_px >= 1:  # less remains where a side is no multiple
            raise FormatError(
                f"the camera information is for {self.size[0]} x {self.size[1]} pixels, and the "
                f"image has {width} x {height}, which is no resizing of it: publish the camera "
                "information of this image"
            )
        return self.camera.scaled(across, down)


def calibrated_camera(info: Any, *, rectified: bool) -> CalibratedCamera:
    """The pinhole camera of a ``sensor_msgs/CameraInfo``.

    ROS 2 has pixel centres at integers, OneMap at half-integers, which is half a pixel more.
    ``rectified``: the image is, so that P holds, not K. Both are of the whole sensor: what shows a
    part of it (``roi``) is refused.
    """
    values = np.asarray(info.p if rectified else info.k, np.float64)
    fx, fy, cx, cy = (values[i] for i in ((0, 5, 2, 6) if rectified else (0, 4, 2, 5)))
    size, roi = (int(info.width), int(info.height)), info.roi
    if min(size) < 1:
        raise FormatError(
            f"the camera information is for {size[0]} x {size[1]} pixels: its publisher must set "
            "width and height, those of the image that was calibrated"
        )
    if roi.x_offset or roi.y_offset or (roi.width, roi.height) not in ((0, 0), size):
        raise FormatError(
            f"the camera information has a region of interest of {roi.width} x {roi.height} "
            f"pixels: publish the whole image of {size[0]} x {size[1]}"
        )
    try:
        camera = Intrinsics(float(fx), float(fy), float(cx) + 0.5, float(cy) + 0.5)
    except ValueError as problem:
        raise FormatError(f"the camera information has no usable camera: {problem}") from problem
    return CalibratedCamera(size, camera)
