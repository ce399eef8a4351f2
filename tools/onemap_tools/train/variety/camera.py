"""The camera of the validation pictures: a response that no training picture has."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8


def photographed(rgb: U8, rng: np.random.Generator) -> U8:
    """The picture (H, W, 3) through a film's curve, mixed channels, sharpening and JPEG."""
    image: F32 = rgb.astype(np.float32) / np.float32(255)
    mixed = np.eye(3) * 0.9 + rng.dirichlet((4, 4, 4), 3) * 0.25
    image = np.asarray(image @ mixed.astype(np.float32).T)
    # A film's curve: x^a / (x^a + m^a), steeper than any gamma of the training.
    steep, middle = rng.uniform(1.1, 1.9), rng.uniform(0.3, 0.6)
    power = np.maximum(image, 1e-4) ** np.float32(steep)
    image = np.asarray(power / (power + np.float32(middle**steep))) * np.float32(1 + middle**steep)
    image = _sharpened(image, rng.uniform(0, 1.2))
    image += rng.normal(0, rng.uniform(0.005, 0.03), image.shape).astype(np.float32)
    picture = (np.clip(image, 0, 1) * 255).astype(np.uint8)
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(35, 95))]
    _, data = cv2.imencode(".jpg", picture, quality)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def _sharpened(image: F32, strength: float) -> F32:
    """Unsharp masking, with the halos of cheap cameras."""
    soft = cv2.GaussianBlur(image, (0, 0), 1.5)
    result: F32 = image + np.float32(strength) * (image - soft)
    return result
