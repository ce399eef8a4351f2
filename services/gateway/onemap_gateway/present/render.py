"""Images: the map with a heatmap of similarity and an overlay, the camera with detections."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import cv2
import numpy as np

from onemap_gateway.present.canvas import Canvas, Viewport, draw_text
from onemap_gateway.present.palette import DARK, Palette, Rgb
from onemap_shared.geometry import F32, F64, U8
from onemap_shared.grid import GridSpec, onto
from onemap_shared.messages import Detections, Occupancy, SearchView

PointsM: TypeAlias = "F32 | F64"

HEATMAP_OPACITY = 0.88  # at heat 1: walls still show through
HEATMAP_THRESHOLD = 0.1  # heat below which the cell keeps its colour
HEAT_LEVELS = 256  # of opacity: neighbours differ by less than a level of grey
MIN_HEATMAP_TOP = 0.25  # least score of heat 1: a weak best match must not look like a find

# Tops of obstacles between which their colour changes to that of a wall, in decimetres: tables,
# beds and sofas are lower. A wall that was only seen from near is known up to 1.4 m.
FURNITURE_DM, WALL_DM = 9, 15

MARGIN_M = 0.5
ROBOT_BEYOND_MAP_M = 50.0  # further out the robot is left out: its pose is wrong
EMPTY_MAP_SIDE_M = 4.0  # of the image of an empty map
DEFAULT_SIDE_PX = 900  # longest side when no scale is given
MAX_PX = 4096
STRIP_ROWS = 128  # of the image that are mixed at once: a whole one would need 0.5 GB
MAX_SCALE = 32


@dataclass(frozen=True, slots=True)
class Overlay:
    """What is drawn over the map, all in metres of the map frame; empty arrays draw nothing.

    robot: (x, y, yaw) or empty. Points are (N, 2). found: (name, x, y) of found objects.
    """

    trail_m: PointsM = field(default_factory=lambda: np.zeros((0, 2)))
    path_m: PointsM = field(default_factory=lambda: np.zeros((0, 2)))
    goal_m: PointsM = field(default_factory=lambda: np.zeros((0, 2)))
    frontiers_m: PointsM = field(default_factory=lambda: np.zeros((0, 2)))
    frontier_scores: PointsM = field(default_factory=lambda: np.zeros(0))
    regions_m: PointsM = field(default_factory=lambda: np.zeros((0, 2)))
    robot: tuple[float, ...] = ()
    found: tuple[tuple[str, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class MapImage:
    """An RGB image (H, W, 3) uint8, or a grey one (H, W), and the part of the map that it shows."""

    image: U8
    bounds_m: tuple[float, float, float, float]
    pixels_per_cell: int


def render_map(
    view: SearchView,
    overlay: Overlay | None = None,
    scale: int | None = None,
    palette: Palette = DARK,
) -> MapImage:
    """The known part of the map with a margin, ``scale`` pixels per cell.

    None for ``scale``: about ``DEFAULT_SIDE_PX`` on the longest side. Without ``overlay`` neither
    overlay nor scale bar is drawn: for clients that draw them. The heatmap covers only cells
    known to be free or occupied: fusion also spreads features into cells that no ray has reached,
    behind walls and inside furniture.
    """
    robot = overlay.robot if overlay else ()
    grid = _visible_grid(view, robot)
    pixels = _pixels_per_cell(grid, scale)
    occupancy = onto(grid, view.grid, view.occupancy, Occupancy.UNKNOWN)
    image = occupancy_image(occupancy, pixels, palette, _tops_on(grid, view))
    if view.similarity.size:
        similarity = onto(grid, view.grid, view.similarity, np.nan)
        similarity[occupancy == Occupancy.UNKNOWN] = np.nan
        image = blend_heatmap(image, similarity, palette)
    if overlay is not None:
        x_min, _, _, y_max = grid.bounds_m
        canvas = Canvas(image, Viewport(x_min, y_max, pixels / grid.cell_size_m))
        draw_overlay(canvas, overlay, palette)
        draw_scale_bar(canvas, palette)
    return MapImage(image, grid.bounds_m, pixels)


def render_tops(view: SearchView) -> MapImage:
    """How high obstacles reach: (H, W) uint8, decimetres as in ``SearchView.tops_dm``, a pixel per
    cell of the part of the map that ``render_map`` shows without an overlay."""
    grid = _visible_grid(view, ())
    return MapImage(np.ascontiguousarray(_as_image(_tops_on(grid, view))), grid.bounds_m, 1)


def occupancy_image(
    occupancy: U8, pixels_per_cell: int, palette: Palette = DARK, tops_dm: U8 | None = None
) -> U8:
    """RGB (ny * s, nx * s, 3) of occupancy (nx, ny): x to the right, y up, nearest neighbour.

    tops_dm (nx, ny): how high obstacles reach, in decimetres, 0 not known.
    """
    wall = np.interp(np.arange(256), (FURNITURE_DM, WALL_DM), (0.0, 1.0))[:, None]
    obstacles = (1 - wall) * palette.occupied + wall * palette.wall  # by their tops
    colours = np.vstack([palette.unknown, palette.free, np.rint(obstacles)]).astype(np.uint8)
    index = occupancy.astype(np.int16)
    if tops_dm is not None:
        index[occupancy == Occupancy.OCCUPIED] += tops_dm[occupancy == Occupancy.OCCUPIED]
    return _upscaled(colours[_as_image(index)], pixels_per_cell, cv2.INTER_NEAREST)


def blend_heatmap(image: U8, similarity: F32, palette: Palette = DARK) -> U8:
    """``image`` blended with the heatmap of similarity (nx, ny), in [0, 1], NaN: no heat.

    The scores are interpolated between cells that have one; cells without keep their colour.
    """
    scores = _as_image(similarity)
    scored = np.isfinite(scores)
    top = max(float(scores.max(where=scored, initial=0.0)), MIN_HEATMAP_TOP)
    factor = image.shape[0] // scores.shape[0]
    smooth = _upscaled(np.where(scored, scores, 0.0), factor, cv2.INTER_LINEAR)
    weight = _upscaled(scored.astype(np.float32), factor, cv2.INTER_LINEAR)
    inside = _upscaled(scored.astype(np.uint8), factor, cv2.INTER_NEAREST)
    result: U8 = np.empty_like(image)
    for first in range(0, len(image), STRIP_ROWS):
        rows = slice(first, first + STRIP_ROWS)
        # inside a scored cell the weight is 1/4 or more; without it the border would fade
        heat = np.clip(smooth[rows] / np.maximum(weight[rows], 0.25) / top, 0.0, 1.0)
        result[rows] = _heated(image[rows], heat.astype(np.float32), inside[rows], palette)
    return result


def _heated(image: U8, heat: F32, inside: U8, palette: Palette) -> U8:
    """``image`` (H, W, 3) with the colour of heat (H, W), in [0, 1], where ``inside`` is 1.

    Opacity and colour are read from tables of ``HEAT_LEVELS``: an image of 4096 x 4096 pixels
    would take a second. The levels are of the opacity, which is a root and steep at first.
    """
    over = (heat - HEATMAP_THRESHOLD) * inside / (1.0 - HEATMAP_THRESHOLD)
    level = cv2.convertScaleAbs(np.sqrt(np.maximum(over, 0.0)), alpha=HEAT_LEVELS - 1)
    opacity, colours = _heat_tables(palette)
    weight = cv2.LUT(level, opacity)
    colour = cv2.applyColorMap(level, colours)
    mixed = cv2.blendLinear(colour, np.ascontiguousarray(image), weight, 1.0 - weight)
    return np.asarray(mixed, np.uint8)


def _heat_tables(palette: Palette) -> tuple[F32, U8]:
    """Opacity (L,) and colour (L, 1, 3) of each level of heat."""
    opacity = np.linspace(0, 1, HEAT_LEVELS, dtype=np.float32)
    heat = HEATMAP_THRESHOLD + (1.0 - HEATMAP_THRESHOLD) * opacity**2
    stops = np.linspace(0, 1, len(palette.heat))
    colours = [np.interp(heat, stops, channel) for channel in np.array(palette.heat).T]
    largest = HEATMAP_OPACITY * (1.0 - HEATMAP_THRESHOLD) ** 0.5
    return opacity * np.float32(largest), np.rint(np.stack(colours, -1)).astype(np.uint8)[:, None]


def draw_overlay(canvas: Canvas, overlay: Overlay, palette: Palette = DARK) -> None:
    """Draw in the order of importance: what is drawn last covers the rest."""
    canvas.line(overlay.trail_m, palette.trail, 2)
    scores = np.clip(np.nan_to_num(overlay.frontier_scores), 0, 1)
    radii_px = [2.5 + 4 * float(score) for score in scores]
    canvas.circles(overlay.frontiers_m, radii_px, palette.frontier)
    canvas.circles(overlay.regions_m, [9] * len(overlay.regions_m), palette.region, 2)
    canvas.line(overlay.path_m, palette.path, 2)
    canvas.circles(overlay.goal_m, [6] * len(overlay.goal_m), palette.path, 2)
    if overlay.robot:
        x, y, yaw = overlay.robot
        canvas.arrow(x, y, yaw, 20, palette.unknown)
        canvas.arrow(x, y, yaw, 16, palette.robot)
    places = [(x, y) for _, x, y in overlay.found]
    canvas.circles(places, [7] * len(places), palette.unknown)
    canvas.circles(places, [5.5] * len(places), palette.found)
    names = [name for name, _, _ in overlay.found]
    canvas.labels(places, names, palette.found, palette.unknown)


def draw_scale_bar(canvas: Canvas, palette: Palette = DARK) -> None:
    """Draw a bar of a round length in the lower left corner, at most a third of the width."""
    height, width = canvas.image.shape[:2]
    longest_m = width / canvas.viewport.pixels_per_m / 3
    lengths = [length for length in (0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if length <= longest_m]
    if not lengths or height < 40:
        return
    length_m = lengths[-1]
    left, right, row = 14, 14 + round(length_m * canvas.viewport.pixels_per_m), height - 14
    for width_px, ink in ((4, palette.unknown), (2, palette.ink)):
        for start, end in (
            ((left, row), (right, row)),
            ((left, row - 4), (left, row)),
            ((right, row - 4), (right, row)),
        ):
            cv2.line(canvas.image, start, end, ink, width_px, cv2.LINE_AA)
    place = (left + 4, row - 7)
    draw_text(canvas.image, f"{length_m:g} m", place, palette.ink, palette.unknown)


def encode_png(image: U8) -> bytes:
    """PNG of an RGB or a grey image."""
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR) if image.ndim == 3 else image
    _, data = cv2.imencode(".png", bgr)
    return data.tobytes()


def _as_image(array: np.ndarray) -> np.ndarray:
    """Rows from the top (largest y), columns from the left (smallest x)."""
    return np.asarray(array.T[::-1])


def _upscaled(image: np.ndarray, factor: int, interpolation: int) -> np.ndarray:
    size = (image.shape[1] * factor, image.shape[0] * factor)
    return np.asarray(cv2.resize(np.ascontiguousarray(image), size, interpolation=interpolation))


def _visible_grid(view: SearchView, robot: tuple[float, ...]) -> GridSpec:
    """The grid to show: all known cells and the robot, unless it is far off, with a margin."""
    known = np.argwhere((view.occupancy != Occupancy.UNKNOWN) | (view.layers != 0))
    points = view.grid.centres(known) if len(known) else np.array([robot[:2] or (0.0, 0.0)])
    if robot:
        outside_m = np.maximum(points.min(axis=0) - robot[:2], robot[:2] - points.max(axis=0))
        if outside_m.max() <= ROBOT_BEYOND_MAP_M:
            points = np.vstack([points, [robot[:2]]])
    margin_m = MARGIN_M if len(known) else EMPTY_MAP_SIDE_M / 2
    lower, upper = points.min(axis=0) - margin_m, points.max(axis=0) + margin_m
    return GridSpec.covering(view.grid.cell_size_m, (lower[0], lower[1]), (upper[0], upper[1]))


def _tops_on(grid: GridSpec, view: SearchView) -> U8:
    """Tops of obstacles on the cells of ``grid``, 0 from a mapper that does not send them."""
    if not view.tops_dm.size:
        return np.zeros(grid.shape, np.uint8)
    return onto(grid, view.grid, view.tops_dm, 0)


def _pixels_per_cell(grid: GridSpec, scale: int | None) -> int:
    longest = max(grid.shape)
    wanted = scale if scale is not None else DEFAULT_SIDE_PX // longest
    return max(1, min(wanted, MAX_PX // longest, MAX_SCALE))


BOX: Rgb = (255, 190, 92)
LABEL_TOP_PX = 16  # lowest row of a label at the upper edge: it is not cut off there


def annotate_detections(rgb: U8, detections: Detections | None) -> U8:
    """A copy of the image (H, W, 3) with a labelled box around each detection."""
    image = np.array(rgb)
    if detections is None:
        return image
    limit = 2 * max(image.shape)  # a box may leave the image, but not OpenCV's integers
    boxes = np.rint(np.clip(detections.boxes_px, -limit, limit)).astype(int)
    for name, score, (x0, y0, x1, y1) in zip(
        detections.names, detections.scores, boxes.tolist(), strict=True
    ):
        cv2.rectangle(image, (x0, y0), (x1, y1), BOX, 2, cv2.LINE_AA)
        draw_text(image, f"{name} {score:.2f}", (max(x0, 2), max(y0 - 5, LABEL_TOP_PX)), BOX)
    return image


def encode_jpeg(image: U8, quality: int) -> bytes:
    """JPEG of an RGB image, ``quality`` in percent."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    _, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), options)
    return data.tobytes()
