"""Which tiles of an image hang together."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import I64, Bool


@compiled
def tile_labels(level: Bool, across: Bool, down: Bool) -> I64:  # pragma: no cover
    """Per tile (rows, columns) the smallest index in its set; rows * columns if it is in none.

    level (rows, columns): which tiles are in a set; across (rows, columns - 1) and down (rows - 1,
    columns): which are linked with the next one of their row, and of their column.
    """
    rows, columns = level.shape
    labels = np.full((rows, columns), rows * columns, np.int64)
    for i in range(rows):
        for j in range(columns):
            if level[i, j]:
                labels[i, j] = i * columns + j
    changed = True
    while changed:
        changed = False
        for i in range(rows):
            for j in range(columns):
                smallest = labels[i, j]
                if j > 0 and across[i, j - 1]:
                    smallest = min(smallest, labels[i, j - 1])
                if j + 1 < columns and across[i, j]:
                    smallest = min(smallest, labels[i, j + 1])
                if i > 0 and down[i - 1, j]:
                    smallest = min(smallest, labels[i - 1, j])
                if i + 1 < rows and down[i, j]:
                    smallest = min(smallest, labels[i + 1, j])
                changed |= smallest != labels[i, j]
                labels[i, j] = smallest
    return labels
