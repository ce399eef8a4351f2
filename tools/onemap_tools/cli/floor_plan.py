"""Draws the floor plan of a scene, seen from above."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from onemap_shared.geometry import F64, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.inspection import FloorMap, StartPose
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene

# BGR, as OpenCV writes them.
UNREACHABLE, REACHABLE, OBSTACLE = (225, 225, 225), (255, 255, 255), (130, 130, 130)
THING, EDGE, INK, START = (225, 190, 140), (170, 110, 50), (60, 30, 0), (40, 40, 220)
LONGEST_PX = 1400  # approximate length of the longer side
FONT, FONT_SCALE = cv2.FONT_HERSHEY_SIMPLEX, 0.45
ARROW_M = 0.4
ALL_HEIGHTS_M = (-np.inf, np.inf)

Box = tuple[int, int, int, int]  # left, top, right, bottom in pixels


def draw_floor_plan(scene: Scene, floor: FloorMap, start: StartPose | None) -> U8:
    """A (rows, columns, 3) uint8 BGR image: x to the right, y upwards.

    White: cells that the robot's centre can reach; dark grey: obstacles; blue: named objects,
    with their category where labels do not overlap; red: the start.
    """
    plan = np.full((*floor.grid.shape, 3), UNREACHABLE, np.uint8)
    plan[floor.reachable] = REACHABLE
    plan[floor.obstacles] = OBSTACLE
    outlines = _outlines(scene, floor.grid)
    for _, outline in outlines:
        plan[outline & floor.obstacles] = THING  # only the outline of what is no obstacle, a rug
        plan[outline & ~cv2.erode(outline.astype(np.uint8), np.ones((3, 3))).astype(bool)] = EDGE
    scale = _scale(floor.grid)
    large = np.repeat(np.repeat(plan, scale, axis=0), scale, axis=1)
    image: U8 = np.ascontiguousarray(large.transpose(1, 0, 2)[::-1])
    if start is not None:
        _draw_start(image, floor.grid, scale, start)
    taken: list[Box] = []
    for name, outline in outlines:
        middle = floor.grid.centres(np.argwhere(outline)).mean(axis=0)
        _draw_label(image, name, _pixel(floor.grid, scale, middle), taken)
    return image


def draw_path(image: U8, grid: GridSpec, path: F64, colour: tuple[int, int, int]) -> U8:
    """The floor plan with a line through places (N, 2) in metres, in BGR."""
    scale = _scale(grid)
    drawn: U8 = image.copy()
    pixels = np.array([_pixel(grid, scale, place) for place in path], np.int32).reshape(-1, 1, 2)
    cv2.polylines(drawn, [pixels], False, colour, 2, cv2.LINE_AA)
    return drawn


def write_png(file: Path, image: U8) -> None:
    """Write a BGR image as PNG; raises OSError."""
    _, encoded = cv2.imencode(".png", image)
    file.write_bytes(encoded.tobytes())


def _outlines(scene: Scene, grid: GridSpec) -> list[tuple[str, Bool]]:
    """Category and footprint (nx, ny) bool of every named object, the largest first."""
    triangles: F64 = scene.vertices[scene.faces].astype(np.float64)
    outlines = [
        (thing.category, rasterise(triangles[scene.face_object == i], grid, ALL_HEIGHTS_M))
        for i, thing in enumerate(scene.objects)
        if thing.category not in STRUCTURE | {UNNAMED}
    ]
    return sorted(outlines, key=lambda item: -int(item[1].sum()))


def _scale(grid: GridSpec) -> int:
    """Pixels per cell."""
    return max(LONGEST_PX // max(grid.shape), 1)


def _pixel(grid: GridSpec, scale: int, position_m: F64) -> tuple[int, int]:
    """Column and row of a position (2,) in metres."""
    x, y = (position_m / grid.cell_size_m - grid.origin_cell) * scale
    return round(float(x)), round(grid.shape[1] * scale - float(y))


def _draw_start(image: U8, grid: GridSpec, scale: int, start: StartPose) -> None:
    position = np.array(start[:2])
    ahead = position + ARROW_M * np.array([np.cos(start[2]), np.sin(start[2])])
    first = _pixel(grid, scale, position)
    cv2.circle(image, first, max(round(0.1 / grid.cell_size_m * scale), 3), START, -1)
    cv2.arrowedLine(image, first, _pixel(grid, scale, ahead), START, 2, tipLength=0.3)


def _draw_label(image: U8, text: str, middle: tuple[int, int], taken: list[Box]) -> None:
    """Write a label around a pixel, within the image, unless it overlaps another."""
    (width, height), base = cv2.getTextSize(text, FONT, FONT_SCALE, 1)
    left = min(max(middle[0] - width // 2, 1), max(image.shape[1] - width - 1, 1))
    bottom = min(max(middle[1] + height // 2, height + 1), image.shape[0] - base - 1)
    box = (left, bottom - height, left + width, bottom + base)
    if any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in taken):
        return
    taken.append(box)
    cv2.putText(image, text, (left, bottom), FONT, FONT_SCALE, INK, 1, cv2.LINE_AA)
