"""Distances from points to the edges of square cells, all at once."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64


def nearest_edges(points: F64, centres: F64, cell_size_m: float) -> F64:
    """Twin of ``onemap_planner.motion.accelerations.nearest_edges``."""
    x, y = np.maximum(np.abs(points.T[..., None] - centres.T[:, None]) - cell_size_m / 2, 0.0)
    nearest: F64 = np.sqrt(x * x + y * y).min(axis=1, initial=np.inf)
    return nearest
