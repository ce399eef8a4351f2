"""What a camera adds to a picture: colour, light, blur, noise, compression.

Functions of an image (h, w, 3) float32 in 0 to 255 and a random generator; whole-array arithmetic.
"""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, F64

MAX_SHOT = 1.2  # noise of a bright pixel over the root of its level: that of a phone in the dark
MAX_MOTION_PX = 7  # length of the trace of a robot that turns


def jittered_colour(image: F32, rng: np.random.Generator) -> F32:
    """White balance, hue, saturation, contrast, exposure, gamma, falling light, a dark rim."""
    image = np.asarray(image @ _colour_matrix(rng).T)
    contrast, mean = np.float32(rng.uniform(0.6, 1.4)), np.float32(image.mean())
    image = (mean + (image - mean) * contrast) * np.float32(np.exp(rng.uniform(-0.6, 0.5)))
    if rng.random() < 0.5:
        image = image * _falling_light(image.shape[:2], rng)
    gamma = np.float32(np.exp(rng.uniform(-0.4, 0.4)))
    corrected: F32 = np.float32(255) * (np.clip(image, 0, 255) / 255) ** gamma
    return corrected


def with_sensor_effects(image: F32, rng: np.random.Generator) -> F32:
    """Blur of focus or of motion, sensor noise by rows and pixels, JPEG artefacts."""
    kind = rng.random()
    if kind < 0.25:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.6)).astype(np.float32)
    elif kind < 0.4:
        image = _moved(image, rng)
    elif kind < 0.5:
        soft = cv2.GaussianBlur(image, (0, 0), 1.2)
        image = image + np.float32(rng.uniform(0, 1)) * (image - soft)
    if rng.random() < 0.5:
        image = _noisy(image, rng)
    if rng.random() < 0.3:
        image = _compressed(image, rng)
    return image


def _colour_matrix(rng: np.random.Generator) -> F32:
    """White balance, a turn of the hue and saturation in one matrix (3, 3)."""
    balance = np.diag(np.exp(rng.uniform(-0.25, 0.25, 3)))
    grey = np.full((3, 3), 1 / 3)
    saturation = 0.0 if rng.random() < 0.07 else rng.uniform(0.4, 1.5)
    turned = hue_rotation(rng.uniform(-0.4, 0.4) if rng.random() < 0.5 else 0.0)
    if rng.random() < 0.1:
        turned = turned[rng.permutation(3)]
    matrix: F32 = (balance @ (grey + saturation * (turned - grey))).astype(np.float32)
    return matrix


def hue_rotation(angle_rad: float) -> F64:
    """The matrix (3, 3) that turns RGB about the grey axis, which it leaves as it is."""
    c, s = np.cos(angle_rad), np.sin(angle_rad) / np.sqrt(3)
    ahead = np.roll(np.eye(3), 1, axis=1)
    return np.asarray(c * np.eye(3) + (1 - c) / 3 + s * (ahead.T - ahead))


def _falling_light(shape: tuple[int, int], rng: np.random.Generator) -> F32:
    """Factor (h, w, 1): a linear gradient of light, and less of it towards the corners."""
    v, u = np.linspace(-1, 1, shape[0])[:, None], np.linspace(-1, 1, shape[1])[None]
    slope_u, slope_v = rng.uniform(-0.4, 0.4, 2)
    factor = (1 + slope_u * u + slope_v * v) * (1 - rng.uniform(0, 0.5) * (u**2 + v**2) / 2)
    result: F32 = factor[..., None].astype(np.float32)
    return result


def _moved(image: F32, rng: np.random.Generator) -> F32:
    """The mean along a short line: the camera turned while its shutter was open."""
    length = int(rng.integers(2, MAX_MOTION_PX + 1))
    kernel = np.zeros((MAX_MOTION_PX, MAX_MOTION_PX), np.float32)
    angle, middle = rng.uniform(-0.4, 0.4), MAX_MOTION_PX // 2  # robots turn: mostly sideways
    reach = np.array([np.cos(angle), np.sin(angle)]) * (length - 1) / 2
    ends = [tuple(int(n) for n in np.rint(middle + sign * reach)) for sign in (-1, 1)]
    cv2.line(kernel, ends[0], ends[1], 1.0)
    return np.asarray(cv2.filter2D(image, -1, kernel / kernel.sum()), np.float32)


def _noisy(image: F32, rng: np.random.Generator) -> F32:
    """Noise that grows with the light, noise that does not, and lines of a rolling shutter."""
    height, width = image.shape[:2]
    grey = rng.random() < 0.3
    noise = rng.standard_normal((height, width, 1 if grey else 3), dtype=np.float32)
    read, shot = np.float32(rng.uniform(0, 10)), np.float32(rng.uniform(0, MAX_SHOT))
    image = image + noise * (read + shot * np.sqrt(np.maximum(image, 0)))
    if rng.random() < 0.3:
        rows = rng.standard_normal((height, 1, 1), dtype=np.float32) * np.float32(rng.uniform(0, 5))
        flicker = np.sin(np.linspace(0, rng.uniform(5, 60), height) + rng.uniform(0, 6))
        waves = np.float32(rng.uniform(0, 0.12)) * flicker[:, None, None].astype(np.float32)
        image = image * (1 + waves) + rows
    return image


def _compressed(image: F32, rng: np.random.Generator) -> F32:
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(15, 85))]
    _, data = cv2.imencode(".jpg", np.clip(image, 0, 255).astype(np.uint8), quality)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.float32)
