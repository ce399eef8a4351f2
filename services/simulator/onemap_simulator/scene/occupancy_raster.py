"""Conservative rasterisation: the floor cells that geometry between two heights touches."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from onemap_shared.geometry import F64, I32, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.scene.scene import Scene

SCENES = 8  # whose rasters are kept: a benchmark returns to its apartments
SHIFT = 8  # cv2 fixed-point bits: polygons are drawn at 1/256 cell


@lru_cache(maxsize=2 * SCENES)
def occupied_cells(
    scene: Scene, cell_size_m: float, z_min: float, z_max: float
) -> tuple[GridSpec, Bool]:
    """Cells (nx, ny) touched by a triangle's part between the heights, and their grid.

    The grid covers the whole scene. Conservative: every touched cell is set, and a cell that
    is merely adjacent to a slanted edge may be set too.
    """
    vertices = scene.vertices.astype(np.float64)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    spec = GridSpec.covering(
        cell_size_m, (float(lower[0]), float(lower[1])), (float(upper[0]), float(upper[1]))
    )
    triangles = vertices[scene.faces[faces_between(scene, z_min, z_max)]]
    cells = rasterise(triangles, spec, (z_min, z_max))
    cells.setflags(write=False)  # shared by whoever asks for them
    return spec, cells


def faces_between(scene: Scene, z_min: float, z_max: float) -> Bool:
    """Faces (F,) of which a part lies between the heights."""
    heights = scene.vertices[:, 2].astype(np.float64)[scene.faces]
    near: Bool = (heights.max(axis=1) >= z_min) & (heights.min(axis=1) <= z_max)
    return near


@lru_cache(maxsize=SCENES)
def outline_segments(scene: Scene, z_min: float, z_max: float) -> F64:
    """Edges (M, 2, 2) in metres, seen from above, of the triangles' parts between the heights."""
    triangles = scene.vertices[scene.faces].astype(np.float64)
    heights = (z_min, z_max)
    return np.concatenate([_clipped_edges(triangles, heights), _cuts(triangles, heights)])


def rasterise(triangles: F64, spec: GridSpec, z_range_m: tuple[float, float]) -> Bool:
    """Cells (nx, ny) of the grid touched by triangles (N, 3, 3) clipped to a height range."""
    image = np.zeros(spec.shape, np.uint8)
    origin = np.asarray(spec.origin_cell, dtype=np.float64)
    corners = triangles.astype(np.float64)
    corners[..., :2] = corners[..., :2] / spec.cell_size_m - origin  # cells; heights in metres
    for segments in (_clipped_edges(corners, z_range_m), _cuts(corners, z_range_m)):
        cells = _cells_along(segments)
        cells = cells[spec.contains(cells)]
        image[cells[:, 0], cells[:, 1]] = 1
    # Only a triangle wider than a cell in x and y can cover a cell that no edge crosses.
    extent = np.ptp(corners[..., :2], axis=1)
    wide = corners[extent.min(axis=1) > 1.0]
    heights = wide[..., 2]
    whole = ((heights >= z_range_m[0]) & (heights <= z_range_m[1])).all(axis=1)
    cut = (_fixed_point(_clip(triangle, z_range_m)) for triangle in wide[~whole])
    for points in (*_fixed_point(wide[whole, :, :2]), *cut):
        if len(points):
            cv2.fillPoly(image, [points], 1, lineType=cv2.LINE_8, shift=SHIFT)
    return image.astype(bool)


def _fixed_point(cells: F64) -> I32:
    """Places (..., 2) in cells as cv2 counts: from pixel centres, columns (the grid's y) first."""
    points: I32 = np.round((cells[..., ::-1] - 0.5) * (1 << SHIFT)).astype(np.int32)
    return points


def _clipped_edges(corners: F64, z_range_m: tuple[float, float]) -> F64:
    """The triangles' edges within the height range: segments (M, 2, 2) in cells."""
    start, end = corners.reshape(-1, 3), np.roll(corners, -1, axis=1).reshape(-1, 3)
    rise = end[:, 2] - start[:, 2]
    level = np.abs(rise) < 1e-12
    safe = np.where(level, 1.0, rise)
    t = np.sort((np.array(z_range_m) - start[:, 2:3]) / safe[:, None], axis=1)
    between = (start[:, 2] >= z_range_m[0]) & (start[:, 2] <= z_range_m[1])
    first = np.where(level, np.where(between, 0.0, 2.0), np.maximum(t[:, 0], 0.0))
    last = np.where(level, 1.0, np.minimum(t[:, 1], 1.0))
    keep = first <= last
    start, step = start[keep, :2], (end - start)[keep, :2]
    return np.stack([start + first[keep, None] * step, start + last[keep, None] * step], axis=1)


def _cuts(corners: F64, z_range_m: tuple[float, float]) -> F64:
    """Where triangles pass through the planes of the two heights: segments (M, 2, 2) in cells."""
    segments = [np.empty((0, 2, 2))]
    for height in z_range_m:
        above = corners[..., 2] >= height
        crossing = corners[above.any(axis=1) & ~above.all(axis=1)]
        if not len(crossing):
            continue
        ahead = np.roll(crossing, -1, axis=1)
        changes = (crossing[..., 2] >= height) != (ahead[..., 2] >= height)  # two per triangle
        start, end = crossing[changes], ahead[changes]
        t = (height - start[:, 2]) / (end[:, 2] - start[:, 2])
        points = start[:, :2] + t[:, None] * (end - start)[:, :2]
        segments.append(points.reshape(-1, 2, 2))
    return np.concatenate(segments)


def _cells_along(segments: F64) -> I64:
    """Every cell (K, 2) that the segments (M, 2, 2), in cells, pass through."""
    corner_cells = np.floor(segments)
    within = (corner_cells[:, 0] == corner_cells[:, 1]).all(axis=1)  # most, of furniture's details
    alone = corner_cells[within, 0].astype(np.int64)
    segments = segments[~within]
    start, step = segments[:, 0], segments[:, 1] - segments[:, 0]
    owner = [np.arange(len(segments)).repeat(2)]
    moments = [np.tile([0.0, 1.0], len(segments))]
    for axis in (0, 1):
        low = np.floor(segments[..., axis].min(axis=1)).astype(np.int64)
        count = np.floor(segments[..., axis].max(axis=1)).astype(np.int64) - low
        index = np.arange(len(segments)).repeat(count)
        line = np.arange(count.sum()) - (np.cumsum(count) - count)[index] + low[index] + 1
        owner.append(index)
        moments.append((line - start[index, axis]) / step[index, axis])
    # By segment, then by moment: complex numbers are sorted at once, in that order.
    pairs = np.sort(np.concatenate(owner) + 1j * np.concatenate(moments))
    whose, when = pairs.real.astype(np.int64), pairs.imag
    same = whose[1:] == whose[:-1]  # between two crossings the segment stays within one cell
    middle, segment = ((when[1:] + when[:-1]) / 2)[same], whose[1:][same]
    cells: I64 = np.floor(start[segment] + middle[:, None] * step[segment]).astype(np.int64)
    return np.concatenate([alone, cells])


def _clip(polygon: F64, z_range_m: tuple[float, float]) -> F64:
    """The outline (N, 2) of a convex polygon (M, 3) cut to the heights (Sutherland-Hodgman).

    Numbers, not arrays: a scene has thousands of such polygons of three or four corners.
    """
    corners: list[tuple[float, ...]] = [tuple(corner) for corner in polygon.tolist()]
    for sign, limit in ((1.0, z_range_m[0]), (-1.0, -z_range_m[1])):
        kept: list[tuple[float, ...]] = []
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            a, b = sign * start[2] - limit, sign * end[2] - limit
            if a >= 0:
                kept.append(start)
            if (a >= 0) != (b >= 0):
                t = a / (a - b)
                kept.append(tuple(p + (q - p) * t for p, q in zip(start, end, strict=True)))
        if not kept:
            return np.empty((0, 2))
        corners = kept
    return np.array(corners)[:, :2]
