"""ROS 2 images and camera information as the arrays that a frame is made of."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from onemap_ros2.cdr import FormatError
from onemap_shared.camera import Intrinsics, project, unproject
from onemap_shared.geometry import F32, F64, U8, U16

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
    """What a ``sensor_msgs/CameraInfo`` says of its images.

    window: width and height of the part of the sensor that they show, in the pixels of the
    calibration. binning: how many of these become one pixel, across and down. camera: of the
    window without binning. is_part: the window is not the whole sensor.
    """

    window: tuple[int, int]
    binning: tuple[int, int]
    camera: Intrinsics
    is_part: bool

    def of_image(self, width: int, height: int) -> Intrinsics:
        """The camera of an image of this size, binned as announced or resized.

        FormatError for another aspect, and for an image larger than a region of interest: it
        shows something else.
        """
        expected = [side / joined for side, joined in zip(self.window, self.binning, strict=True)]
        resized = width / expected[0], height / expected[1]
        if abs(width - expected[0]) < 1 and abs(height - expected[1]) < 1:
            resized = 1.0, 1.0  # binning leaves out what fills no whole pixel
        off_px = max(abs(height - expected[1] * resized[0]), abs(width - expected[0] * resized[1]))
        if off_px >= 1 or (self.is_part and max(resized) > 1):
            raise FormatError(
                f"the camera information is for {self._window()}, and the image has {width} x "
                f"{height}, which is no resizing of it: publish the camera information of this "
                "image"
            )
        scales = (scale / joined for scale, joined in zip(resized, self.binning, strict=True))
        return self.camera.scaled(*scales)

    def _window(self) -> str:
        part = "a region of interest of " if self.is_part else ""
        binned = f", binned by {self.binning[0]} x {self.binning[1]}"
        shown = f"{part}{self.window[0]} x {self.window[1]} pixels"
        return shown + binned * (max(self.binning) > 1)


def calibrated_camera(info: Any, *, rectified: bool) -> CalibratedCamera:
    """The pinhole camera of a ``sensor_msgs/CameraInfo``.

    ROS 2 has pixel centres at integers, OneMap at half-integers, which is half a pixel more.
    ``rectified``: the image is, so that P holds, not K. Both are of the whole sensor, of which
    ``roi`` names the part that is published, and ``binning`` the pixels that are joined; 0: all of
    it, and none.
    """
    values = np.asarray(info.p if rectified else info.k, np.float64)
    fx, fy, cx, cy = (values[i] for i in ((0, 5, 2, 6) if rectified else (0, 4, 2, 5)))
    size, roi = (int(info.width), int(info.height)), info.roi
    if min(size) < 1:
        raise FormatError(
            f"the camera information is for {size[0]} x {size[1]} pixels: its publisher must set "
            "width and height, those of the image that was calibrated"
        )
    part = int(roi.width) or size[0], int(roi.height) or size[1]
    if roi.x_offset + part[0] > size[0] or roi.y_offset + part[1] > size[1]:
        raise FormatError(
            f"the camera information has a region of interest of {part[0]} x {part[1]} pixels at "
            f"({roi.x_offset}, {roi.y_offset}), outside of its {size[0]} x {size[1]}"
        )
    try:
        camera = Intrinsics(
            float(fx), float(fy), float(cx) + 0.5 - roi.x_offset, float(cy) + 0.5 - roi.y_offset
        )
    except ValueError as problem:
        raise FormatError(f"the camera information has no usable camera: {problem}") from problem
    binning = max(int(info.binning_x), 1), max(int(info.binning_y), 1)
    return CalibratedCamera(part, binning, camera, is_part=part != size)


NOTHING = 65535  # mm; further than any measurement
MAX_SPREAD = 8  # pixels of the color image to a pixel of depth, along each side


@dataclass(frozen=True, slots=True)
class CameraPair:
    """A depth camera beside a color camera; T_color_depth (4, 4) between their optical frames."""

    depth: Intrinsics
    color: Intrinsics
    T_color_depth: F64


def register_depth(depth_mm: U16, cameras: CameraPair, shape: tuple[int, int]) -> U16:
    """The depth (H, W) uint16 in mm, 0 invalid, for each pixel of a color image of ``shape``.

    Each measured pixel becomes a point, and the color pixels that it covers get its depth; where
    several points meet, the nearest one. Pixels that no point reaches are 0.
    """
    rows, columns = np.nonzero(depth_mm)
    points = unproject(depth_mm.astype(np.float32) * np.float32(1e-3), cameras.depth)[rows, columns]
    R, t = cameras.T_color_depth[:3, :3].astype(np.float32), cameras.T_color_depth[:3, 3]
    points = points @ R.T + t.astype(np.float32)
    points = points[points[:, 2] >= 5e-4]  # under half a millimetre, and behind
    millimetres = np.rint(points[:, 2] * 1e3)
    kept = np.flatnonzero(millimetres < NOTHING)
    far_first = kept[np.argsort(~millimetres[kept].astype(np.uint16), kind="stable")]  # radix sort
    values = millimetres[far_first].astype(np.uint16)
    pixels = project(points[far_first], cameras.color)
    registered = np.zeros(shape[0] * shape[1], np.uint16)
    spread = min(max(round(cameras.color.focal_px / cameras.depth.focal_px), 1), MAX_SPREAD)
    first = np.floor(pixels - np.float32(0.5 * (spread - 1) - 0.5)).astype(np.int32)
    for down in range(spread):
        for right in range(spread):
            u, v = first[:, 0] + right, first[:, 1] + down
            inside = (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
            one = np.zeros_like(registered)
            one[v[inside] * shape[1] + u[inside]] = values[inside]  # the nearest is written last
            registered = np.where(
                (one > 0) & ((registered == 0) | (one < registered)), one, registered
            )
    return registered.reshape(shape)
