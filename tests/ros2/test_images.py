from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from onemap_ros2 import images
from onemap_ros2.cdr import CAMERA_INFO, FormatError, decode, header, new
from onemap_shared.camera import Intrinsics
from tests.ros2.robot_messages import FX, HEIGHT, WIDTH, camera_info, compressed, image

IMAGE = "sensor_msgs/msg/Image"
RGB = np.arange(HEIGHT * WIDTH * 3, dtype=np.uint8).reshape(HEIGHT, WIDTH, 3)
ALPHA = np.full((HEIGHT, WIDTH, 1), 255, np.uint8)


@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("rgb8", RGB),
        ("bgr8", RGB[..., ::-1]),
        ("rgba8", np.concatenate([RGB, ALPHA], axis=2)),
        ("bgra8", np.concatenate([RGB[..., ::-1], ALPHA], axis=2)),
    ],
)
def test_every_color_encoding_becomes_rgb(encoding: str, pixels: np.ndarray) -> None:
    np.testing.assert_array_equal(
        images.color_image(decode(image(1, pixels, encoding), IMAGE)), RGB
    )


def test_depth_in_metres_is_rounded_and_what_is_invalid_is_zero() -> None:
    metres = np.array([[0.0, 1.2344, np.nan, np.inf, -1.0, 65.535, 70.0, 0.0004]], np.float32)
    depth_mm = images.depth_image_mm(decode(image(1, metres, "32FC1"), IMAGE))
    assert depth_mm.tolist() == [[0, 1234, 0, 0, 0, 65535, 0, 0]]


@pytest.mark.parametrize("dtype", ["<u2", ">u2"])
def test_padded_rows_and_byte_order_are_honoured(dtype: str) -> None:
    depth = np.array([[1, 2], [3, 400]])
    rows = np.zeros((2, 7), np.uint8)
    rows[:, :4] = depth.astype(dtype).view(np.uint8)
    big = int(dtype[0] == ">")
    message = new(IMAGE, header(1, "camera"), 2, 2, "16UC1", big, 7, rows.ravel())
    depth_mm = images.depth_image_mm(message)
    assert depth_mm.dtype == np.uint16
    assert depth_mm.tolist() == depth.tolist()


def test_what_is_not_supported_or_does_not_fit_is_refused() -> None:
    odd = decode(image(1, RGB, "yuv422"), IMAGE)
    with pytest.raises(FormatError, match=r"'yuv422' is not supported; supported are rgb8"):
        images.color_image(odd)
    with pytest.raises(FormatError, match=r"16UC1 \(millimetres\)"):
        images.depth_image_mm(odd)
    for width, step in ((9, 24), (8, 240), (0, 24)):
        message = new(IMAGE, header(1, "camera"), HEIGHT, width, "rgb8", 0, step, RGB.ravel())
        with pytest.raises(FormatError, match="needs rows of at least"):
            images.color_image(message)


def test_pixel_centres_move_by_half_a_pixel() -> None:
    camera = camera_of(camera_info(1), WIDTH, HEIGHT)
    assert camera == Intrinsics(FX, FX, WIDTH / 2, HEIGHT / 2)
    rectified = images.calibrated_camera(decode(camera_info(1), CAMERA_INFO), rectified=True)
    assert rectified.of_image(WIDTH, HEIGHT).fx == 2 * FX


def camera_of(info: bytes, width: int, height: int) -> Intrinsics:
    """The camera of an image of this size, by its camera information."""
    made = images.calibrated_camera(decode(info, CAMERA_INFO), rectified=False)
    return made.of_image(width, height)


HD = 1280, 720, 600.0


@pytest.mark.parametrize(
    ("info", "size", "scale"),
    [
        (camera_info(1, *HD), (1280, 720), 1.0),
        (camera_info(1, *HD), (640, 360), 0.5),  # binned or resized
        (camera_info(1, 640, 360, 300.0), (1280, 720), 2.0),
        (camera_info(1, 1281, 721, 600.0), (640, 360), 640 / 1281),
        (camera_info(1, *HD, roi=(0, 0, 1280, 720)), (1280, 720), 1.0),  # all of it
    ],
)
def test_each_pixel_keeps_its_ray_when_the_image_is_resized(
    info: bytes, size: tuple[int, int], scale: float
) -> None:
    camera, decoded = camera_of(info, *size), decode(info, CAMERA_INFO)
    for edge in (0.0, 0.25, 1.0):  # of the image, from its corner; in pixels of the calibration:
        x = (edge * size[0] / scale - 0.5 - decoded.k[2]) / decoded.k[0]
        assert (edge * size[0] - camera.cx) / camera.fx == pytest.approx(x, abs=1e-9)


@pytest.mark.parametrize(
    ("info", "size", "reason"),
    [
        (camera_info(1, *HD), (640, 480), "is for 1280 x 720 pixels, and the image has 640 x 480"),
        (camera_info(1, *HD, roi=(0, 0, 640, 360)), (640, 360), "interest of 640 x 360 pixels: "),
        (camera_info(1, 0, 0), (640, 360), "must set width and height"),
        (camera_info(1, fx=0.0), (WIDTH, HEIGHT), "no usable camera"),
    ],
)
def test_camera_information_of_another_image_is_refused(
    info: bytes, size: tuple[int, int], reason: str
) -> None:
    with pytest.raises(FormatError, match=reason):
        camera_of(info, *size)


COMPRESSED = "sensor_msgs/msg/CompressedImage"
DEPTH_MM = np.array([[0, 1, 1500], [2000, 3000, 65535]], np.uint16)


def squeezed(pixels: np.ndarray, ending: str = ".png") -> bytes:
    done, data = cv2.imencode(ending, pixels)
    assert done
    return bytes(data)


def read_depth(data: bytes, form: str) -> np.ndarray:
    return images.compressed_depth_mm(decode(compressed(1, data, form), COMPRESSED))


@pytest.mark.parametrize(("ending", "error"), [(".png", 0), (".jpg", 12)])
def test_compressed_color_becomes_rgb(ending: str, error: int) -> None:
    rows, columns = np.mgrid[0:48, 0:64]
    rgb = np.stack([rows * 4, columns * 3, 255 - rows * 4], axis=2).astype(np.uint8)
    message = decode(compressed(1, squeezed(rgb[..., ::-1], ending), "rgb8; jpeg"), COMPRESSED)
    difference = images.compressed_color(message).astype(int) - rgb
    assert np.abs(difference).max() <= error


@pytest.mark.parametrize("form", ["16UC1; compressedDepth", "16UC1; compressedDepth png"])
def test_compressed_depth_has_a_header_before_its_png(form: str) -> None:
    data = struct.pack("<iff", 0, 0.0, 0.0) + squeezed(DEPTH_MM)
    np.testing.assert_array_equal(read_depth(data, form), DEPTH_MM)


def test_compressed_metres_are_inverse() -> None:
    metres = np.array([[0.5, 1.0, 4.0]])
    scale, offset = 200.0, 10.0
    raw = np.rint(scale / metres + offset).astype(np.uint16)
    raw = np.append(raw, [[0, 5]], axis=1).astype(np.uint16)  # invalid: none, and not positive
    data = struct.pack("<iff", 0, scale, offset) + squeezed(raw)
    depth = read_depth(data, "32FC1; compressedDepth png")
    assert depth.tolist() == [[500, 1000, 4000, 0, 0]]


@pytest.mark.parametrize(
    ("data", "form", "reason"),
    [
        (b"x" * 40, "16UC1; compressedDepth rvl", "is not supported"),
        (b"x" * 40, "8UC1; compressedDepth png", "is not supported"),
        (b"x" * 40, "16UC1; compressedDepth png", "is no JPEG or PNG"),
        (b"x" * 12, "16UC1; compressedDepth png", "no room for its header"),
        (b"", "16UC1; png compressed", "is no JPEG or PNG"),
        (squeezed(DEPTH_MM.astype(np.uint8)), "16UC1; png compressed", "PNG of 16 bits"),
    ],
)
def test_compressed_depth_that_cannot_be_read_is_refused(
    data: bytes, form: str, reason: str
) -> None:
    with pytest.raises(FormatError, match=reason):
        read_depth(data, form)
