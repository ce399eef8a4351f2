"""Detectors that answer with boxes: how a box becomes cells, and which boxes count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from onemap_perception.detectors.protocol import Detection
from onemap_shared.geometry import U8, Bool

# A thing rarely fills its box: the corners show what is behind it. Of the box this share of
# each side, around its middle, stands for the thing; the depth median then drops the rest.
INNER_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class BoxLimits:
    """score: from which a box counts, of this detector alone, scores of two are not the same
    thing; detections: how many at most, per image and name."""

    score: float
    detections: int = 16


@dataclass(frozen=True, slots=True)
class Box:
    """What a network answered: corners x0, y0, x1, y1 in pixels, maybe beyond the image."""

    name: str
    score: float
    corners_px: tuple[float, float, float, float]


def detections_from_boxes(
    boxes: Iterable[Box], rgb: U8, limits: BoxLimits
) -> tuple[Detection, ...]:
    """Detections of the boxes that count, clipped to the image (H, W, 3), best first."""
    height, width = rgb.shape[:2]
    counting = sorted(
        (box for box in boxes if box.score >= limits.score), key=lambda box: -box.score
    )
    found: list[Detection] = []
    kept: Counter[str] = Counter()
    for box in counting:
        if kept[box.name] == limits.detections:
            continue
        x0, x1 = np.clip((box.corners_px[0], box.corners_px[2]), 0, width)
        y0, y1 = np.clip((box.corners_px[1], box.corners_px[3]), 0, height)
        if not (x1 > x0 and y1 > y0):  # also refuses NaN
            continue
        corners = (float(x0), float(y0), float(x1), float(y1))
        mask = inner_mask(corners, (width, height))
        kept[box.name] += 1
        found.append(Detection(box.name, float(min(box.score, 1.0)), corners, mask))
    return tuple(found)


def inner_mask(corners_px: tuple[float, float, float, float], image_px: tuple[int, int]) -> Bool:
    """The middle of a box as pixels (H, W) bool of an image of (W, H): one pixel at least."""
    width, height = image_px
    x0, y0, x1, y1 = corners_px
    columns = _inner(x0, x1, width)
    rows = _inner(y0, y1, height)
    mask = np.zeros((height, width), bool)
    mask[rows, columns] = True
    return mask


def _inner(low: float, high: float, size: int) -> slice:
    middle, half = (low + high) / 2, (high - low) / 2 * INNER_SHARE
    first = min(int(middle - half), size - 1)
    return slice(max(first, 0), max(int(np.ceil(middle + half)), first + 1))
