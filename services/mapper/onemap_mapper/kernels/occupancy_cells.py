"""What is counted per cell and voxel of a frame, and the evidence that it makes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, I32, I64, Bool

Counts = tuple[I32, I32, I32, I32]  # (nx, ny) each: low points, drops, floor, blind


@compiled
def count_places(
    places_m: F32, origin: tuple[int, int], shape: tuple[int, int], cell_size_m: float
) -> I32:  # pragma: no cover
    """How many of the places (n, 2 or 3) lie in each cell (nx, ny), int32."""
    counts = np.zeros(shape, np.int32)
    for k in range(len(places_m)):
        i = int(np.floor(np.float64(places_m[k, 0]) / cell_size_m)) - origin[0]
        j = int(np.floor(np.float64(places_m[k, 1]) / cell_size_m)) - origin[1]
        counts[i, j] += 1
    return counts


@compiled
def evidence_of(
    voxels: tuple[I32, Bool], counts: Counts, origin: tuple[int, int], weights: I64
) -> tuple[I64, NDArray[np.int8], Bool, Bool]:  # pragma: no cover
    """Cells (n, 2), evidence (n, levels + 1), clear and blind (n,) of ``OccupancyUpdate``.

    voxels: points in each voxel (nx, ny, levels), and whether a ray crosses it; weights: (evidence
    of several points, of one, of low points, of a drop, of a miss, and how many are several).
    """
    (hits, crossed), (low, drops, seen, blind) = voxels, counts
    hit, single, low_hit, drop_hit, miss, several = weights
    nx, ny, levels = hits.shape
    cells = np.empty((nx * ny, 2), np.int64)
    evidence = np.empty((nx * ny, levels + 1), np.int8)
    clear, hidden = np.empty(nx * ny, np.bool_), np.empty(nx * ny, np.bool_)
    filled = 0
    for i in range(nx):
        for j in range(ny):
            floor = seen[i, j] > 0
            touched = floor | (blind[i, j] > 0)
            row = evidence[filled]
            for level in range(levels):
                value = -miss if crossed[i, j, level] else np.int64(0)
                value = single if hits[i, j, level] > 0 else value
                value = hit if hits[i, j, level] >= several else value
                if level == 0 and low[i, j] >= several and value < low_hit:
                    value = low_hit
                row[level] = value
                touched |= value != 0
            value = -miss if floor else np.int64(0)
            value = drop_hit if drops[i, j] >= several else value
            row[levels] = value
            if touched | (value != 0):
                cells[filled, 0], cells[filled, 1] = i + origin[0], j + origin[1]
                clear[filled], hidden[filled] = floor, blind[i, j] > 0
                filled += 1
    return cells[:filled], evidence[:filled], clear[:filled], hidden[:filled]
