"""Products with the rows of a table, read once."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled_fast
from onemap_shared.geometry import F32


@compiled_fast
def products(table: F32, vector: F32, out: F32) -> None:  # pragma: no cover
    """out (n,) = table (n, D) times vector (D,) float32."""
    for k in range(len(out)):
        row = table[k]
        total = np.float32(0)
        for channel in range(len(vector)):
            total += row[channel] * vector[channel]
        out[k] = total
