"""Prepares images for vision towers, and makes one feature of a picture of one thing."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_perception.errors import ImageError
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import check_image, expect

LEAST_CONTRAST = 2.0  # standard deviation of 255: an even wall, a covered lens


def fitted_size(width: int, height: int, *, long_side_px: int, stride: int) -> tuple[int, int]:
    """(width, height) in multiples of ``stride``: the longer side ``long_side_px``, the shape kept.

    The shorter side is off by half a stride at most, and one cell at least.
    """
    scale = long_side_px / max(width, height)
    columns, rows = (max(round(side * scale / stride), 1) for side in (width, height))
    return columns * stride, rows * stride


def resized(rgb: U8, size: tuple[int, int]) -> U8:
    """The image (H, W, 3) at (width, height) ``size``; reducing averages pixels."""
    expect(rgb, "rgb", np.uint8, (None, None, 3))
    if size == (rgb.shape[1], rgb.shape[0]):
        return rgb
    reduces = size[0] <= rgb.shape[1] and size[1] <= rgb.shape[0]
    method = cv2.INTER_AREA if reduces else cv2.INTER_CUBIC
    image: U8 = cv2.resize(rgb, size, interpolation=method).astype(np.uint8)
    return image


def pixel_values(rgb: U8, mean: F32, std: F32) -> F32:
    """(1, 3, H, W) float32 of an image (H, W, 3): (value / 255 - mean) / std, both (3,)."""
    scale = np.float32(1 / 255) / std
    image: F32 = rgb.astype(np.float32) * scale - mean / std
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None])


def decoded(data: bytes) -> U8:
    """The image (H, W, 3) uint8, RGB, of a PNG or JPEG; raises ImageError."""
    try:
        check_image(data)
    except ValueError as problem:
        raise ImageError(str(problem)) from problem
    bgr = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    if bgr is None:
        raise ImageError("the image cannot be decoded: it is damaged or cut off")
    if bgr.std(axis=(0, 1)).max() < LEAST_CONTRAST:
        raise ImageError("the image shows nothing but one colour: send a crop of the thing")
    rgb: U8 = np.ascontiguousarray(bgr[..., ::-1])
    return rgb


def mean_feature(features: F16, weights: F32) -> F32:
    """Unit vector (D,) float32: the mean of features (h, w, D) weighted by (h, w)."""
    mean = np.tensordot(weights, features.astype(np.float32), axes=2)
    unit: F32 = (mean / max(float(np.linalg.norm(mean)), 1e-12)).astype(np.float32)
    return unit


def framed(rgb: U8, size: tuple[int, int]) -> tuple[U8, F32]:
    """The crop (h, w, 3) in the middle of an image (H, W, 3) of ``size``, (W, H), as large as fits.

    Also its mask (H, W) float32, 1 where the crop is; around it is its mean colour. So towers that
    were compiled or exported for the camera's images take crops of any shape.
    """
    width, height = size
    scale = min(width / rgb.shape[1], height / rgb.shape[0])
    inner = tuple(max(round(side * scale), 1) for side in (rgb.shape[1], rgb.shape[0]))
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    place = np.s_[top : top + inner[1], left : left + inner[0]]
    image: U8 = np.empty((height, width, 3), np.uint8)
    image[:] = np.rint(rgb.mean(axis=(0, 1)))
    image[place] = cv2.resize(rgb, inner, interpolation=method)
    mask: F32 = np.zeros((height, width), np.float32)
    mask[place] = 1.0
    return image, mask


def patch_shares(mask: F32, rows: int, columns: int) -> F32:
    """Share (rows, columns) float32 of each patch that a mask (H, W) covers."""
    shares = cv2.resize(mask, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(shares, np.float32)
