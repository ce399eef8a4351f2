"""Drawing in metres of the map frame, x to the right, y up, with labels that do not overlap."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np

from onemap_gateway.present.palette import Rgb
from onemap_shared.geometry import F64, U8

Box: TypeAlias = tuple[float, float, float, float]  # left, top, right, bottom in pixels

GAP_PX = 10.0  # between a point and its label


def place_labels(
    points_px: Sequence[tuple[float, float]],
    sizes_px: Sequence[tuple[float, float]],
    image_size_px: tuple[float, float],
) -> list[Box]:
    """A box for each label (width, height) beside its point (column, row), inside the image.

    In order: each takes the height nearest to its point at which it covers no earlier label, or
    without room the height of its point. A label wider than the image begins at its left edge.
    """
    placed: list[Box] = []
    for (x, y), size in zip(points_px, sizes_px, strict=True):
        width, height = size
        left = x + GAP_PX if x + GAP_PX + width <= image_size_px[0] else x - GAP_PX - width
        shifts = sorted(range(-2 * len(points_px), 2 * len(points_px) + 1), key=abs)
        tops = [y - height / 2 + shift * height for shift in shifts]
        boxes = [_inside((left, top, left + width, top + height), image_size_px) for top in tops]
        free = (box for box in boxes if not any(overlap(box, other) for other in placed))
        placed.append(next(free, boxes[0]))
    return placed


def overlap(a: Box, b: Box) -> bool:
    """Whether two boxes share an area."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _inside(box: Box, image_size_px: tuple[float, float]) -> Box:
    """The box moved into the image."""
    width, height = box[2] - box[0], box[3] - box[1]
    left = max(min(box[0], image_size_px[0] - width), 0.0)
    top = max(min(box[1], image_size_px[1] - height), 0.0)
    return (left, top, left + width, top + height)


Points: TypeAlias = "np.ndarray | Sequence[tuple[float, float]]"

SHIFT = 4  # OpenCV draws with this many bits below the pixel
FONT_SCALE = 0.6  # capitals of 13 pixels
OUTLINE_PX = 2  # around every letter
BELOW_PX = 7  # descender and outline below the base line
BLACK: Rgb = (12, 16, 22)
FONT = cv2.FONT_HERSHEY_SIMPLEX


@dataclass(frozen=True, slots=True)
class Viewport:
    """The part of the map that an image shows, and its scale."""

    x_min_m: float
    y_max_m: float
    pixels_per_m: float

    def pixels(self, points_m: Points) -> F64:
        """Pixel coordinates (N, 2), column and row, of map points (N, 2) in metres."""
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
        offset = np.stack([points[:, 0] - self.x_min_m, self.y_max_m - points[:, 1]], axis=1)
        return offset * self.pixels_per_m


@dataclass(frozen=True, slots=True)
class Canvas:
    """An RGB image (H, W, 3) uint8 to draw on, in metres of the map frame."""

    image: U8
    viewport: Viewport

    def line(self, points_m: Points, colour: Rgb, width_px: int) -> None:
        """Draw an anti-aliased line through the points."""
        if len(points_m) > 1:
            fixed = _fixed_point(self.viewport.pixels(points_m))
            cv2.polylines(self.image, [fixed], False, colour, width_px, cv2.LINE_AA, SHIFT)

    def circles(
        self, points_m: Points, radii_px: Sequence[float], colour: Rgb, width_px: int = cv2.FILLED
    ) -> None:
        """Draw circles, filled unless their line has a width."""
        fixed = _fixed_point(self.viewport.pixels(points_m)).tolist()
        for centre, radius_px in zip(fixed, radii_px, strict=True):
            radius = round(radius_px * (1 << SHIFT))
            cv2.circle(self.image, centre, radius, colour, width_px, cv2.LINE_AA, SHIFT)

    def arrow(self, x_m: float, y_m: float, yaw_rad: float, length_px: float, colour: Rgb) -> None:
        """Draw an arrowhead centred at the point, its tip along ``yaw_rad``."""
        angles = yaw_rad + np.array([0.0, 2.45, np.pi, -2.45])
        radii = length_px * np.array([0.65, 0.6, 0.25, 0.6])
        offsets = np.stack([np.cos(angles), -np.sin(angles)], axis=1) * radii[:, None]
        outline = _fixed_point(self.viewport.pixels([(x_m, y_m)]) + offsets)
        cv2.fillPoly(self.image, [outline], colour, cv2.LINE_AA, SHIFT)

    def labels(
        self, points_m: Points, texts: Sequence[str], colour: Rgb, outline: Rgb = BLACK
    ) -> None:
        """Draw each text with an outline beside its point, where it covers no other label."""
        plain = [ascii_text(text) for text in texts]
        sizes = [_text_size_px(text) for text in plain]
        height, width = self.image.shape[:2]
        places = [(float(x), float(y)) for x, y in self.viewport.pixels(points_m)]
        for text, box in zip(plain, place_labels(places, sizes, (width, height)), strict=True):
            lower_left = (round(box[0]) + OUTLINE_PX, round(box[3]) - BELOW_PX)
            draw_text(self.image, text, lower_left, colour, outline)


def ascii_text(text: str) -> str:
    """The text in ASCII, which is what the font has: without accents, '?' for other letters."""
    plain = unicodedata.normalize("NFKD", text)
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    return plain.encode("ascii", "replace").decode()


def draw_text(
    image: U8, text: str, place_px: tuple[int, int], colour: Rgb, outline: Rgb = BLACK
) -> None:
    """Draw the text (in ASCII) with an outline; ``place_px``: column and row of its lower left.

    The outline is the text's own mask, dilated: a thicker stroke would be a wider text in the
    fonts of OpenCV 5.
    """
    plain = ascii_text(text)
    width, height = (round(value) for value in _text_size_px(plain))
    left, bottom = place_px[0] - OUTLINE_PX, place_px[1] + BELOW_PX
    mask = np.zeros((height, width), np.uint8)
    cv2.putText(mask, plain, (OUTLINE_PX, height - BELOW_PX), FONT, FONT_SCALE, 255, 1, cv2.LINE_AA)
    halo = cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * OUTLINE_PX + 1,) * 2))
    rows = slice(max(bottom - height, 0), max(min(bottom, image.shape[0]), 0))
    columns = slice(max(left, 0), max(min(left + width, image.shape[1]), 0))
    inside = np.s_[
        rows.start - bottom + height : rows.stop - bottom + height,
        columns.start - left : columns.stop - left,
    ]
    drawn = image[rows, columns].astype(np.float32)
    for part, ink in ((halo, outline), (mask, colour)):
        alpha = part[inside][..., None] / np.float32(255)
        drawn += alpha * (np.array(ink, np.float32) - drawn)
    image[rows, columns] = np.rint(drawn)


def _text_size_px(text: str) -> tuple[float, float]:
    """Width and height with outline and descenders."""
    (width, height), _ = cv2.getTextSize(text, FONT, FONT_SCALE, 1)
    return width + 2 * OUTLINE_PX, height + OUTLINE_PX + BELOW_PX


def _fixed_point(points_px: F64) -> np.ndarray:
    """Fixed-point coordinates; a pixel's centre is an integer for OpenCV, a half here."""
    limit = 2**26  # far outside of any image, and still within OpenCV's integers
    scaled = (points_px - 0.5) * (1 << SHIFT)
    return np.rint(np.clip(scaled, -limit, limit)).astype(np.int32)
