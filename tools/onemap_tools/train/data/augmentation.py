"""Random changes of camera, light and material, so that classes are not recognised by colour.

Functions of an image, its labels and a random generator.
"""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_tools.train.data.frame_dataset import NAMELESS, NO_CLASS
from onemap_tools.train.data.sensor import hue_rotation, jittered_colour, with_sensor_effects

STRONG_ZOOM = (0.65, 1.4)  # crop size over output size: below 1 enlarges
WEAK_ZOOM = (0.9, 1.25)
MAX_LOG_STRETCH = 0.15  # of the aspect ratio
MAX_DISTORTION = 0.12  # of a lens: shift at the corner over its distance from the middle
PATTERN_PX = (2, 40)  # period of a random texture
LABELS = 256


def augment_strong(
    rgb: U8, label: U8, size: tuple[int, int], rng: np.random.Generator
) -> tuple[U8, U8]:
    """rgb (H, W, 3) and label (H, W) to (h, w, 3) and (h, w), ``size`` = (w, h)."""
    rgb, label = _crop(rgb, label, size, zoom=rng.uniform(*STRONG_ZOOM), rng=rng)
    if rng.random() < 0.3:
        rgb, label = _through_lens(rgb, label, rng)
    if rng.random() < 0.5:
        rgb, label = rgb[:, ::-1], label[:, ::-1]
    image = rgb.astype(np.float32)
    if rng.random() < 0.4:
        image = _recolour_classes(image, label, rng)
    image = with_sensor_effects(jittered_colour(image, rng), rng)
    if rng.random() < 0.2:
        image, label = _cutout(image, label, rng)
    return np.clip(image, 0, 255).astype(np.uint8), np.ascontiguousarray(label)


def augment_camera(rgb: U8, label: U8, rng: np.random.Generator) -> tuple[U8, U8]:
    """Random mirroring and another camera's colours, blur and noise, without a crop."""
    if rng.random() < 0.5:
        rgb, label = rgb[:, ::-1], label[:, ::-1]
    image = with_sensor_effects(jittered_colour(rgb.astype(np.float32), rng), rng)
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


def _through_lens(rgb: U8, label: U8, rng: np.random.Generator) -> tuple[U8, U8]:
    """Barrel or pincushion distortion about the middle; outside of the image there is no class."""
    height, width = label.shape
    v, u = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j].astype(np.float32)
    bend = np.float32(rng.uniform(-MAX_DISTORTION, MAX_DISTORTION))
    # Scaled so that the middle of the sides stays: only the corners may leave the image.
    factor = (1 + bend * (u * u + v * v)) / (1 + max(float(bend), 0.0))
    columns = (u * factor + 1) * np.float32((width - 1) / 2)
    rows = (v * factor + 1) * np.float32((height - 1) / 2)
    image = cv2.remap(rgb, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    bent = cv2.remap(
        label,
        columns,
        rows,
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=NO_CLASS,
    )
    return np.asarray(image, np.uint8), np.asarray(bent, np.uint8)


def _recolour_classes(image: F32, label: U8, rng: np.random.Generator) -> F32:
    """Another hue, brightness and texture for about half of the classes in the image."""
    matrices = np.tile(np.eye(3, dtype=np.float32), (LABELS, 1, 1))
    relief = np.zeros((LABELS, 1), np.float32)
    for index in np.unique(label):
        if index == NO_CLASS or (index != NAMELESS and rng.random() < 0.5):
            continue
        gain = rng.uniform(0.5, 1.5, 3) * rng.uniform(0.7, 1.2)
        turned = hue_rotation(rng.uniform(-np.pi, np.pi) if rng.random() < 0.5 else 0.0)
        matrices[index] = gain[:, None] * turned
        relief[index] = rng.uniform(0, 0.5)
    mixed = np.matmul(matrices[label], image[..., None])[..., 0]
    recoloured: F32 = np.clip(mixed * (1 + relief[label] * _pattern(label.shape, rng)), 0, 255)
    return recoloured


def _cutout(image: F32, label: U8, rng: np.random.Generator) -> tuple[F32, U8]:
    """One rectangle of plain colour, labelled as no class."""
    height, width = label.shape
    h, w = rng.integers(height // 10, height // 3), rng.integers(width // 10, width // 3)
    y, x = rng.integers(0, height - h), rng.integers(0, width - w)
    image, label = image.copy(), label.copy()
    image[y : y + h, x : x + w] = rng.uniform(0, 255, 3)
    label[y : y + h, x : x + w] = NO_CLASS
    return image, label
