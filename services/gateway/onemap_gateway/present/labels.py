"""Where labels stand in an image: beside their points and, where possible, not on each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TypeAlias

Box: TypeAlias = tuple[float, float, float, float]  # left, top, right, bottom in pixels

GAP_PX = 10.0  # between a point and its label


def place_labels(
    points_px: Sequence[tuple[float, float]],
    sizes_px: Sequence[tuple[float, float]],
    image_size_px: tuple[float, float],
) -> list[Box]:
    """A box for each label (width, height) near its point (column, row).

    In order: each takes the first place, right of its point, left, above, below, then further
    up and down, that is inside the image (width, height) and covers neither an earlier label nor
    a point; if there is none, the place that covers the least of the labels, then of the points.
    A label wider than the image begins at its left edge.
    """
    r = GAP_PX / 2
    dots = [(x - r, y - r, x + r, y + r) for x, y in points_px]
    rings = 2 * len(points_px) + 2  # a label blocks two rows of another: enough for all
    placed: list[Box] = []
    for point, size in zip(points_px, sizes_px, strict=True):
        places = [_inside(box, image_size_px) for box in _candidates(point, size, rings)]
        placed.append(min(places, key=lambda box: (_covered(box, placed), _covered(box, dots))))
    return placed


def overlap_px2(a: Box, b: Box) -> float:
    """Area that two boxes share."""
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    return max(width, 0.0) * max(height, 0.0)


def _covered(box: Box, others: Sequence[Box]) -> float:
    return sum(overlap_px2(box, other) for other in others)


def _candidates(point: tuple[float, float], size: tuple[float, float], rings: int) -> list[Box]:
    """Places in order of preference, also up to ``rings`` label heights up and down."""
    (x, y), (width, height) = point, size
    columns = (x + GAP_PX, x - GAP_PX - width, x - width / 2)
    middle = y - height / 2
    level = [(left, middle) for left in columns[:2]]
    near = [(columns[2], y - GAP_PX - height), (columns[2], y + GAP_PX)]
    shifts = [sign * ring * height for ring in range(1, rings + 1) for sign in (-1, 1)]
    far = [(left, middle + shift) for shift, left in product(shifts, columns)]
    return [(left, top, left + width, top + height) for left, top in (*level, *near, *far)]


def _inside(box: Box, image_size_px: tuple[float, float]) -> Box:
    """The box moved into the image."""
    width, height = box[2] - box[0], box[3] - box[1]
    left = max(min(box[0], image_size_px[0] - width), 0.0)
    top = max(min(box[1], image_size_px[1] - height), 0.0)
    return (left, top, left + width, top + height)
