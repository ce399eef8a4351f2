"""Outlines of regions: the polygon around connected cells."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import F32, I64, Bool
from onemap_shared.grid import GridSpec

# A cell's sides, from corner to corner counter-clockwise, and its neighbour beyond each.
SIDES = (
    ((0, 0), (1, 0), (0, -1)),
    ((1, 0), (1, 1), (1, 0)),
    ((1, 1), (0, 1), (0, 1)),
    ((0, 1), (0, 0), (-1, 0)),
)


def outline(cells: I64, grid: GridSpec) -> F32:
    """Corners (P, 2) in metres of the polygon around 8-connected cells (K, 2), counter-clockwise.

    The first corner is not repeated. Holes are filled; cells that touch at a corner alone are
    joined by the cells beside it, so that the polygon never touches itself.
    """
    low = cells.min(axis=0) - 1
    mask = np.zeros(tuple(cells.max(axis=0) - low + 2), bool)
    mask[tuple((cells - low).T)] = True
    mask = ndimage.binary_fill_holes(_without_diagonals(mask))
    corners = _loop(mask)
    world = corners + low + np.asarray(grid.origin_cell)
    metres: F32 = (world * grid.cell_size_m).astype(np.float32)
    return metres


def _without_diagonals(mask: Bool) -> Bool:
    """The mask with every block of two by two filled that only holds a diagonal."""
    filled: Bool = mask.copy()
    while True:
        a, b, c, d = filled[:-1, :-1], filled[1:, 1:], filled[1:, :-1], filled[:-1, 1:]
        diagonal = (a & b & ~c & ~d) | (~a & ~b & c & d)
        if not diagonal.any():
            return filled
        for x in (0, 1):
            for y in (0, 1):
                nx, ny = diagonal.shape
                filled[x : x + nx, y : y + ny] |= diagonal


def _loop(mask: Bool) -> I64:
    """Corners (P, 2) around the only part of a mask without holes, where the direction changes."""
    after: dict[tuple[int, int], tuple[int, int]] = {}
    for start, end, (dx, dy) in SIDES:
        cells = np.argwhere(mask & ~np.roll(mask, (-dx, -dy), (0, 1)))
        for (x, y), (x_end, y_end) in zip(
            (cells + start).tolist(), (cells + end).tolist(), strict=True
        ):
            after[x, y] = (x_end, y_end)
    first = min(after)
    loop, here = [first], after[first]
    while here != first:
        loop.append(here)
        here = after[here]
    points = np.array(loop)
    turns = np.any(
        np.diff(points, axis=0, append=points[:1]) != np.diff(points, axis=0, prepend=points[-1:]),
        axis=1,
    )
    return points[turns]
