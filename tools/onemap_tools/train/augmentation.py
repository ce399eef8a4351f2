"""Random changes of camera, light and material, so that classes are not recognised by colour.

Functions of an image, its labels and a random generator.
"""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_tools.train.frames import NO_CLASS

STRONG_ZOOM = (0.65, 1.4)  # crop size over output size: below 1 enlarges
WEAK_ZOOM = (0.9, 1.25)
MAX_LOG_STRETCH = 0.15  # of the aspect ratio
PATTERN_PX = (2, 40)  # period of a random texture


def augment_strong(
    rgb: U8, label: U8, size: tuple[int, int], rng: np.random.Generator
) -> tuple[U8, U8]:
    """rgb (H, W, 3) and label (H, W) to (h, w, 3) and (h, w), ``size`` = (w, h)."""
    rgb, label = _crop(rgb, label, size, zoom=rng.uniform(*STRONG_ZOOM), rng=rng)
    if rng.random() < 0.5:
        rgb, label = rgb[:, ::-1], label[:, ::-1]
    image = rgb.astype(np.float32)
    if rng.random() < 0.4:
        image = _recolour_classes(image, label, rng)
    image = _jitter_colour(image, rng)
    image = _sensor_effects(image, rng)
    if rng.random() < 0.2:
        image, label = _cutout(image, label, rng)
    return np.clip(image, 0, 255).astype(np.uint8), np.ascontiguousarray(label)


def augment_weak(
    rgb: U8, label: U8, size: tuple[int, int], rng: np.random.Generator
) -> tuple[U8, U8]:
    """As ``augment_strong``, but close to the simulator's own camera."""
    rgb, label = _crop(rgb, label, size, zoom=rng.uniform(*WEAK_ZOOM), rng=rng)
    return augment_full_image(rgb, label, rng)


def augment_full_image(rgb: U8, label: U8, rng: np.random.Generator) -> tuple[U8, U8]:
    """Random mirroring, slight change of brightness and noise, without a crop."""
    if rng.random() < 0.5:
        rgb, label = rgb[:, ::-1], label[:, ::-1]
    noise = rng.standard_normal(rgb.shape, dtype=np.float32)
    image = rgb * np.float32(rng.uniform(0.85, 1.15)) + np.float32(rng.uniform(0, 4)) * noise
    return np.clip(image, 0, 255).astype(np.uint8), np.ascontiguousarray(label)


def _crop(
    rgb: U8, label: U8, size: tuple[int, int], *, zoom: float, rng: np.random.Generator
) -> tuple[U8, U8]:
    """A random part of a randomly changed aspect ratio, resized to ``size``."""
    height, width = label.shape
    stretch = np.exp(rng.uniform(-MAX_LOG_STRETCH, MAX_LOG_STRETCH))
    w = min(int(size[0] * zoom * stretch), width)
    h = min(int(size[1] * zoom / stretch), height)
    x, y = rng.integers(0, width - w + 1), rng.integers(0, height - h + 1)
    part = np.s_[y : y + h, x : x + w]
    shrinks = w > size[0]
    image = cv2.resize(
        rgb[part], size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )
    labels = cv2.resize(label[part], size, interpolation=cv2.INTER_NEAREST)
    return image.astype(np.uint8), labels.astype(np.uint8)


def _pattern(shape: tuple[int, int], rng: np.random.Generator) -> F32:
    """Smooth noise or stripes (h, w, 1) float32 within [-1, 1], of mean about 0."""
    height, width = shape
    period = float(np.exp(rng.uniform(*np.log(PATTERN_PX))))
    if rng.random() < 0.4:
        angle = rng.uniform(0, np.pi)
        v, u = np.mgrid[:height, :width].astype(np.float32)
        wave = np.sin((u * np.cos(angle) + v * np.sin(angle)) * (2 * np.pi / period))
        stripes: F32 = wave[..., None].astype(np.float32)
        return stripes
    coarse = (int(np.ceil(height / period)) + 1, int(np.ceil(width / period)) + 1)
    noise = rng.uniform(-1, 1, coarse).astype(np.float32)
    smooth = cv2.resize(noise, (width, height), interpolation=cv2.INTER_LINEAR)
    noise_pattern: F32 = smooth[..., None].astype(np.float32)
    return noise_pattern


def _recolour_classes(image: F32, label: U8, rng: np.random.Generator) -> F32:
    """Another colour and texture for about half of the classes in the image."""
    result = image.copy()
    for index in np.unique(label):
        if index == NO_CLASS or rng.random() < 0.5:
            continue
        gain = rng.uniform(0.5, 1.5, 3) * rng.uniform(0.7, 1.2)
        pattern = 1 + rng.uniform(0, 0.5) * _pattern(label.shape, rng)
        mask = label == index
        result[mask] = (image * gain.astype(np.float32) * pattern)[mask]
    recoloured: F32 = np.clip(result, 0, 255)
    return recoloured


def _jitter_colour(image: F32, rng: np.random.Generator) -> F32:
    """White balance, brightness, contrast, gamma, saturation, and a linear gradient of light."""
    image = image * np.exp(rng.uniform(-0.2, 0.2, 3)).astype(np.float32)
    grey = image.mean(axis=2, keepdims=True)
    saturation = 0.0 if rng.random() < 0.07 else rng.uniform(0.4, 1.5)
    image = grey + (image - grey) * np.float32(saturation)
    if rng.random() < 0.1:
        image = image[..., rng.permutation(3)]
    contrast, mean = np.float32(rng.uniform(0.6, 1.4)), np.float32(image.mean())
    image = (mean + (image - mean) * contrast) * np.float32(np.exp(rng.uniform(-0.5, 0.4)))
    if rng.random() < 0.3:
        height, width = image.shape[:2]
        slope_u, slope_v = rng.uniform(-0.5, 0.5, 2)
        ramp = (
            1
            + slope_u * np.linspace(-1, 1, width)[None, :]
            + slope_v * np.linspace(-1, 1, height)[:, None]
        )
        image = image * ramp[..., None].astype(np.float32)
    gamma = np.float32(np.exp(rng.uniform(-0.35, 0.35)))
    corrected: F32 = np.float32(255) * (np.clip(image, 0, 255) / 255) ** gamma
    return corrected


def _sensor_effects(image: F32, rng: np.random.Generator) -> F32:
    """Blur, sensor noise and JPEG artefacts."""
    if rng.random() < 0.25:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.5)).astype(np.float32)
    if rng.random() < 0.5:
        noise = rng.standard_normal(image.shape, dtype=np.float32)
        image = image + np.float32(rng.uniform(0, 14)) * noise
    if rng.random() < 0.1:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(20, 80))]
        _, data = cv2.imencode(".jpg", np.clip(image, 0, 255).astype(np.uint8), quality)
        image = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR)).astype(np.float32)
    return image


def _cutout(image: F32, label: U8, rng: np.random.Generator) -> tuple[F32, U8]:
    """One rectangle of plain colour, labelled as no class."""
    height, width = label.shape
    h, w = rng.integers(height // 10, height // 3), rng.integers(width // 10, width // 3)
    y, x = rng.integers(0, height - h), rng.integers(0, width - w)
    image, label = image.copy(), label.copy()
    image[y : y + h, x : x + w] = rng.uniform(0, 255, 3)
    label[y : y + h, x : x + w] = NO_CLASS
    return image, label
