"""GridSpec: the only place where world coordinates become cells.

Every grid array in OneMap is indexed ``[ix, iy]`` with shape (nx, ny): the
first axis follows the map's x, the second its y. Cell (ix, iy) of an array
is cell ``origin_cell + (ix, iy)`` of the world, and world cell i covers
[i * cell_size, (i + 1) * cell_size): floor, for negative coordinates too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F64, I64, Bool

MAX_CELLS = 2**24  # 410 m x 410 m at 0.1 m: 128 MB for each array of float64 over a grid


class GridTooLarge(ValueError):
    """An array over these cells would fill the memory; the text says why in one sentence."""


def world_cells(points: NDArray[np.floating], cell_size_m: float) -> I64:
    """World cells (..., 2) int64 of points (..., 2 or more) in metres, divided in their dtype."""
    xy = np.asarray(points)[..., :2]
    cells: I64 = np.floor(xy / cell_size_m).astype(np.int64)
    return cells


@dataclass(frozen=True, slots=True)
class GridSpec:
    """A rectangle of square cells in the map frame.

    Raises ``GridTooLarge`` beyond ``MAX_CELLS``: no array over a grid is larger, whatever a pose or
    a camera says.

    Attributes:
        cell_size_m: edge of a cell, in metres; world cell i covers [i, i + 1) times this.
        origin_cell: world index of array element [0, 0], along x and y.
        shape: nx, ny: cells along x and y.
    """

    cell_size_m: float
    origin_cell: tuple[int, int]
    shape: tuple[int, int]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.cell_size_m) and self.cell_size_m > 0):
            raise ValueError(f"cell_size_m is {self.cell_size_m}; it must be positive")
        if min(self.shape) < 0:
            raise ValueError(f"grid shape {self.shape} must not be negative")
        if self.shape[0] * self.shape[1] > MAX_CELLS:
            raise GridTooLarge(
                f"a grid of {self.shape[0]} x {self.shape[1]} cells is larger than {MAX_CELLS} "
                "cells: did the pose jump, or is its unit not metres?"
            )

    def cells(self, points: F64) -> I64:
        """Array indices (..., 2) int64 of points (..., 2 or more) in metres; may lie outside."""
        world = world_cells(points, self.cell_size_m)
        return world - np.asarray(self.origin_cell, dtype=np.int64)

    def centres(self, cells: I64) -> F64:
        """Map coordinates (..., 2) in metres of the centres of array indices (..., 2)."""
        world = np.asarray(cells) + np.asarray(self.origin_cell)
        centres: F64 = (world + 0.5) * self.cell_size_m
        return centres

    def contains(self, cells: I64) -> Bool:
        """Whether array indices (..., 2) lie inside the grid."""
        cells = np.asarray(cells)
        inside = (cells >= 0) & (cells < np.asarray(self.shape))
        return np.asarray(inside.all(axis=-1))

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) in metres."""
        (ox, oy), (nx, ny), size = self.origin_cell, self.shape, self.cell_size_m
        return (ox * size, oy * size, (ox + nx) * size, (oy + ny) * size)

    @classmethod
    def covering(
        cls, cell_size_m: float, lower_m: tuple[float, float], upper_m: tuple[float, float]
    ) -> GridSpec:
        """The smallest grid that contains both corner points (metres)."""
        lower, upper = world_cells(np.array([lower_m, upper_m], np.float64), cell_size_m)
        upper = upper + 1
        shape = np.maximum(upper - lower, 0)
        return cls(cell_size_m, (int(lower[0]), int(lower[1])), (int(shape[0]), int(shape[1])))


def onto(grid: GridSpec, source: GridSpec, layer: NDArray, fill: float = 0) -> NDArray:
    """A layer on ``source`` as it is on ``grid``; ``fill`` where the source has no cells."""
    moved = np.full(grid.shape, fill, layer.dtype)
    shift = np.subtract(source.origin_cell, grid.origin_cell)
    low = np.maximum(shift, 0)
    high = np.minimum(shift + source.shape, grid.shape)
    if (high > low).all():
        (x0, y0), (x1, y1) = low, high
        dx, dy = shift
        moved[x0:x1, y0:y1] = layer[x0 - dx : x1 - dx, y0 - dy : y1 - dy]
    return moved


def area_mask(grid: GridSpec, area_m: tuple[float, ...]) -> Bool | None:
    """Cells (nx, ny) whose centres lie in x_min, y_min, x_max, y_max; None for an empty area."""
    if not area_m:
        return None
    x_min, y_min, x_max, y_max = area_m
    nx, ny = grid.shape
    x = grid.centres(np.stack([np.arange(nx), np.zeros(nx, np.int64)], axis=1))[:, 0]
    y = grid.centres(np.stack([np.zeros(ny, np.int64), np.arange(ny)], axis=1))[:, 1]
    inside: Bool = ((x >= x_min) & (x <= x_max))[:, None] & ((y >= y_min) & (y <= y_max))
    return inside
