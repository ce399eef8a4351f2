"""Distances to the nearest cell of a mask, as far as they matter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F64, Bool


def distances_m(mask: Bool, cell_size_m: float, within_m: float, *, less_m: float = 0.0) -> F64:
    """(nx, ny): metres, less ``less_m``, to the centre of the nearest true cell.

    Infinity where that is more than ``within_m``: a transform of all distances takes several times
    as long, and nobody asks how far away something is that is far.
    """
    reach = int(np.ceil((within_m + less_m) / cell_size_m))
    none = reach * reach + 1  # squares of cells are whole numbers, and there are few
    table_m = np.sqrt(np.arange(none + 1.0)) * cell_size_m - less_m
    table_m[none] = np.inf
    box = _box_around(mask, reach)
    squares = np.where(mask[box], 0, none).astype(np.uint16 if 2 * none < 2**16 else np.int64)
    squares = _least_around(_least_around(squares, reach).T, reach).T
    around_m: F64 = table_m.take(squares, mode="clip")
    if around_m.shape == mask.shape:
        return around_m
    away_m = np.full(mask.shape, np.inf)
    away_m[box] = around_m
    return away_m


def _least_around(squares: NDArray[np.integer], reach: int) -> NDArray[np.integer]:
    """The least of each value and those up to ``reach`` steps away along the first axis, to which
    the squares of the steps are added."""
    least: NDArray[np.integer] = squares.copy(order="K")
    for step in range(1, min(reach + 1, len(squares))):
        farther = squares + squares.dtype.type(step * step)
        np.minimum(least[step:], farther[:-step], out=least[step:])
        np.minimum(least[:-step], farther[step:], out=least[:-step])
    return least


def _box_around(mask: Bool, reach: int) -> tuple[slice, slice]:
    """The smallest part of the grid with all cells within ``reach`` of a true one."""
    x, y = (np.flatnonzero(mask.any(axis=axis)).tolist() for axis in (1, 0))
    if not x:
        return slice(0), slice(0)
    return (
        slice(max(x[0] - reach, 0), x[-1] + reach + 1),
        slice(max(y[0] - reach, 0), y[-1] + reach + 1),
    )
