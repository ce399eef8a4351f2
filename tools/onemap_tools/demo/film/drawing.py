"""Draws a picture of a film: map with heat and marks, camera, objects, one line of text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import TypeAlias

import cv2
import numpy as np

from onemap_gateway.present.canvas import FONT, FONT_SCALE, Canvas, Viewport, ascii_text, draw_text
from onemap_gateway.present.palette import DARK, Rgb
from onemap_gateway.present.render import (
    annotate_detections,
    draw_overlay,
    draw_scale_bar,
    render_map,
)
from onemap_shared.geometry import U8
from onemap_shared.messages import SearchState, SearchStatus
from onemap_tools.demo.film.moment import FilmMoment

BoundsM: TypeAlias = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max in metres

PAGE: Rgb = (8, 11, 16)
WAITING: Rgb = (110, 127, 147)
ROW_PX = 26  # of a line of text
LISTED_OBJECTS = 4
SWATCH_PX = 18  # width of a colour in the legend
LEGEND: tuple[tuple[str, tuple[Rgb, ...]], ...] = (  # in rows of three
    ("driven", (DARK.trail,)),
    ("planned", (DARK.path,)),
    ("frontier", (DARK.frontier,)),
    ("candidate", (DARK.region,)),
    ("how much it looks like it", DARK.heat),
)


@dataclass(frozen=True, slots=True)
class Panel:
    """A part of the picture, in pixels."""

    left: int
    top: int
    width: int
    height: int

    def put(self, picture: U8, image: U8) -> None:
        """Draw an image of the panel's size there."""
        rows = slice(self.top, self.top + self.height)
        picture[rows, self.left : self.left + self.width] = image


PICTURE = Panel(0, 0, 960, 540)
MAP = Panel(12, 12, 532, 478)
CAMERA = Panel(556, 12, 392, 294)
OBJECTS = Panel(556, 318, 392, 172)
CAPTION = Panel(12, 490, 936, 50)


def common_bounds(moments: Sequence[FilmMoment]) -> BoundsM:
    """The part of the map that holds what is known in any of the moments."""
    bounds = np.array([render_map(moment.view, scale=1).bounds_m for moment in moments])
    lower, upper = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    return float(lower[0]), float(lower[1]), float(upper[0]), float(upper[1])


def draw_moment(moment: FilmMoment, bounds_m: BoundsM, speed: float) -> U8:
    """The picture (540, 960, 3) RGB of a moment; its map shows ``bounds_m``."""
    picture = np.full((PICTURE.height, PICTURE.width, 3), PAGE, np.uint8)
    MAP.put(picture, draw_map(moment, bounds_m, (MAP.width, MAP.height)))
    CAMERA.put(picture, draw_camera(moment, (CAMERA.width, CAMERA.height)))
    _draw_objects(picture, moment.status)
    rate = f"{speed:.0f} x real time"
    rate_px = text_width_px(rate)
    caption = fitted(caption_text(moment), CAPTION.width - rate_px - ROW_PX)
    line = CAPTION.top + 32
    draw_text(picture, caption, (CAPTION.left + 2, line), DARK.ink, PAGE)
    draw_text(picture, rate, (CAPTION.left + CAPTION.width - rate_px, line), WAITING, PAGE)
    return picture


def draw_map(moment: FilmMoment, bounds_m: BoundsM, size_px: tuple[int, int]) -> U8:
    """The map of a moment with its marks, ``bounds_m`` fitted into an image (width, height)."""
    x_min, y_min, x_max, y_max = bounds_m
    width, height = size_px
    pixels_per_m = min(width / (x_max - x_min), height / (y_max - y_min))
    viewport = Viewport(
        (x_min + x_max - width / pixels_per_m) / 2,
        (y_min + y_max + height / pixels_per_m) / 2,
        pixels_per_m,
    )
    drawn = render_map(moment.view, scale=ceil(pixels_per_m * moment.view.grid.cell_size_m))
    scale = pixels_per_m * moment.view.grid.cell_size_m / drawn.pixels_per_cell
    ((left, top),) = viewport.pixels([(drawn.bounds_m[0], drawn.bounds_m[3])])
    centred = (scale - 1) / 2  # a pixel's centre is an integer for OpenCV, a half here
    matrix = np.array([[scale, 0, left + centred], [0, scale, top + centred]])
    image = cv2.warpAffine(
        drawn.image, matrix, size_px, borderMode=cv2.BORDER_CONSTANT, borderValue=DARK.unknown
    ).astype(np.uint8)
    canvas = Canvas(image, viewport)
    draw_overlay(canvas, moment.overlay)
    draw_scale_bar(canvas)
    return image


def draw_camera(moment: FilmMoment, size_px: tuple[int, int]) -> U8:
    """The camera's image with labelled boxes, fitted into an image (width, height)."""
    image = np.full((size_px[1], size_px[0], 3), PAGE, np.uint8)
    height, width = moment.camera.shape[:2]
    scale = min(size_px[0] / width, size_px[1] / height)
    inner = (round(width * scale), round(height * scale))
    resized = cv2.resize(moment.camera, inner, interpolation=cv2.INTER_LINEAR).astype(np.uint8)
    found = moment.detections
    if found is not None:
        found = replace(found, boxes_px=(found.boxes_px * scale).astype(np.float32))
    left, top = (size_px[0] - inner[0]) // 2, (size_px[1] - inner[1]) // 2
    image[top : top + inner[1], left : left + inner[0]] = annotate_detections(resized, found)
    return image


def caption_text(moment: FilmMoment) -> str:
    """What is searched, the state, seconds, and how many are found, in one line."""
    status = moment.status
    found = sum(result.outcome is SearchState.FOUND for result in status.results)
    total = f"{found} of {len(status.objects)} found"
    if status.active:
        return f"Looking for: {status.target}   {status.state}   {moment.elapsed_s:.0f} s   {total}"
    ended = f"{total} in {moment.elapsed_s:.0f} s"
    early = status.state in (SearchState.FAILED, SearchState.CANCELLED)
    return f"{ended}   {status.state}: {status.reason}" if early else ended


def object_lines(status: SearchStatus) -> list[tuple[str, Rgb]]:
    """A line for each object, at most ``LISTED_OBJECTS``, around the one that is searched."""
    lines = [(f"{name}: next", WAITING) for name in status.objects]
    for number in range(len(lines)):
        result = status.result_of(number)
        if result is not None:
            outcome = str(result.outcome).replace("_", " ")
            colour = DARK.found if result.outcome is SearchState.FOUND else WAITING
            lines[number] = (f"{result.name}: {outcome} after {result.duration_s:.0f} s", colour)
        elif status.active and number == status.index:
            lines[number] = (f"{status.target}: {status.state}", DARK.ink)
    first = min(max(status.index - 1, 0), max(len(lines) - LISTED_OBJECTS, 0))
    return lines[first : first + LISTED_OBJECTS]


def fitted(text: str, width_px: int) -> str:
    """The text, cut with three dots where it would be wider."""
    text = ascii_text(text)
    if text_width_px(text) <= width_px:
        return text
    return max(
        (text[:end].rstrip() + "..." for end in range(len(text))),
        key=lambda cut: (text_width_px(cut) <= width_px, len(cut)),
    )


def text_width_px(text: str) -> int:
    """Width of a text as ``draw_text`` draws it, without outline."""
    return cv2.getTextSize(ascii_text(text), FONT, FONT_SCALE, 1)[0][0]


def _draw_objects(picture: U8, status: SearchStatus) -> None:
    """Draw the objects with how far they are, and below them the legend of the map."""
    row = OBJECTS.top + 18
    for text, colour in object_lines(status):
        cv2.circle(picture, (OBJECTS.left + 8, row - 5), 5, colour, cv2.FILLED, cv2.LINE_AA)
        place = (OBJECTS.left + 24, row)
        draw_text(picture, fitted(text, OBJECTS.width - 30), place, colour, PAGE)
        row += ROW_PX
    for number, (text, colours) in enumerate(LEGEND):
        left = OBJECTS.left + number % 3 * (OBJECTS.width // 3)
        row = OBJECTS.top + OBJECTS.height - 8 - (1 - number // 3) * ROW_PX
        ends = np.linspace(left, left + SWATCH_PX, len(colours) + 1).round().astype(int).tolist()
        for begin, end, colour in zip(ends[:-1], ends[1:], colours, strict=True):
            cv2.rectangle(picture, (begin, row - 7), (end - 1, row - 4), colour, cv2.FILLED)
        draw_text(picture, text, (left + SWATCH_PX + 8, row), WAITING, PAGE)
