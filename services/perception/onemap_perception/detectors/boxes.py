"""Boxes of networks to detections: which boxes count, and which pixels they stand for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from onemap_perception.detectors.protocol import Detection
from onemap_shared.geometry import Bool

# An object rarely fills its box: the corners show the background. This share of each side, around
# the middle of the box, stands for the object; the median of the depth removes the rest.
INNER_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Box:
    """A box of a network: corners x0, y0, x1, y1 in pixels, possibly beyond the image."""

    name: str
    score: float
    corners_px: tuple[float, float, float, float]


def detections_from_boxes(
    boxes: Iterable[Box],
    image_px: tuple[int, int],
    *,
    score_threshold: float,
    max_detections: int,
) -> tuple[Detection, ...]:
    """Detections of the boxes from the threshold on, clipped to the image (W, H), best first.

    At most ``max_detections`` of a name.
    """
    width, height = image_px
    accepted = sorted(
        (box for box in boxes if box.score >= score_threshold), key=lambda box: -box.score
    )
    detections: list[Detection] = []
    count: Counter[str] = Counter()
    for box in accepted:
        if count[box.name] == max_detections:
            continue
        x0, x1 = np.clip((box.corners_px[0], box.corners_px[2]), 0, width)
        y0, y1 = np.clip((box.corners_px[1], box.corners_px[3]), 0, height)
        if not (x1 > x0 and y1 > y0):  # also refuses NaN
            continue
        corners = (float(x0), float(y0), float(x1), float(y1))
        count[box.name] += 1
        detections.append(
            Detection(box.name, float(min(box.score, 1.0)), corners, inner_mask(corners, image_px))
        )
    return tuple(detections)


def inner_mask(corners_px: tuple[float, float, float, float], image_px: tuple[int, int]) -> Bool:
    """The middle of a box as pixels (H, W) bool of an image (W, H): one pixel at least."""
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
