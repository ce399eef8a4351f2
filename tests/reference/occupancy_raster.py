"""Occupied cells the slow way: points sampled densely on every triangle."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64


def surface_points(triangle: F64, spacing_m: float) -> F64:
    """Points (N, 3) on a triangle (3, 3), about ``spacing_m`` apart, its edges included."""
    longest = max(float(np.linalg.norm(triangle[i] - triangle[i - 1])) for i in range(3))
    count = max(int(np.ceil(longest / spacing_m)), 1)
    points = []
    for i in range(count + 1):
        for j in range(count + 1 - i):
            u, v = i / count, j / count
            points.append(triangle[0] * (1 - u - v) + triangle[1] * u + triangle[2] * v)
    return np.array(points)


def touched_cells(
    triangles: F64, cell_size_m: float, z_range_m: tuple[float, float], spacing_m: float
) -> set[tuple[int, int]]:
    """World cells of all sampled points (of triangles (N, 3, 3)) between the heights."""
    cells = set()
    for triangle in triangles:
        for x, y, z in surface_points(triangle, spacing_m):
            if z_range_m[0] <= z <= z_range_m[1]:
                cells.add((int(np.floor(x / cell_size_m)), int(np.floor(y / cell_size_m))))
    return cells
