"""Rows of features fused in place."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, I64

GREATEST = np.finfo(np.float32).max


@compiled
def fuse_rows(
    table: F32, rows: I64, features: F32, chosen: I64, K: F32
) -> None:  # pragma: no cover
    """Move table[rows[k]] (., D) float32 by K[chosen[k]] towards features[chosen[k]].

    As ``torch.lerp``: from whichever end is nearer, so that 0 and 1 give the ends themselves.
    """
    for k in range(len(rows)):
        share = K[chosen[k]]
        row, new = table[rows[k]], features[chosen[k]]
        if share < 0.5:
            for channel in range(len(row)):
                row[channel] += share * (new[channel] - row[channel])
        else:
            rest = np.float32(1) - share
            for channel in range(len(row)):
                row[channel] = new[channel] - rest * (new[channel] - row[channel])


@compiled
def all_finite(values: F32) -> bool:  # pragma: no cover
    """Whether no value of (n, D) float32 is NaN or infinite."""
    for k in range(len(values)):
        # A row by its index, and a count as wide as the values: so the loop is made with vectors.
        row, wrong = values[k], np.int32(0)
        for channel in range(len(row)):
            wrong += np.int32(not abs(row[channel]) <= GREATEST)
        if wrong > 0:
            return False
    return True
