"""Distances from points to the edges of map cells."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64


def edge_distance(points: F64, centres: F64, cell_size_m: float) -> F64:
    """Distance (N,) of each point to the nearest edge of square cells; infinity without cells."""
    if len(centres) == 0:
        return np.full(len(points), np.inf)
    nearest: F64 = edge_distances(points, centres, cell_size_m).min(axis=1)
    return nearest


def edge_distances(points: F64, centres: F64, cell_size_m: float) -> F64:
    """Distances (N, M) of N points to the edges of M square cells; 0 inside."""
    apart = np.abs(points[:, None] - centres[None]) - cell_size_m / 2
    distances: F64 = np.linalg.norm(np.maximum(apart, 0.0), axis=2)
    return distances
