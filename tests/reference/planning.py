"""Slow, obvious twins of the planner's computations."""

from __future__ import annotations

import heapq
import math

import numpy as np

from onemap_shared.geometry import F32, F64, I64, Bool


def dijkstra(cost: F64, start: tuple[int, int]) -> F64:
    """Cost in cells from ``start`` to every cell; a step costs its length times the mean cost."""
    total = np.full(cost.shape, np.inf)
    total[start] = 0.0
    queue = [(0.0, start)]
    while queue:
        spent, (x, y) = heapq.heappop(queue)
        if spent > total[x, y]:
            continue
        for dx in (-1, 0, 1):
            for dy in (-1, 0, 1):
                to = (x + dx, y + dy)
                inside = 0 <= to[0] < cost.shape[0] and 0 <= to[1] < cost.shape[1]
                if (dx, dy) == (0, 0) or not inside or cost[to] <= 0:
                    continue
                after = spent + math.hypot(dx, dy) * (cost[x, y] + cost[to]) / 2
                if after < total[to]:
                    total[to] = after
                    heapq.heappush(queue, (after, to))
    return total


def sampled_line(start: tuple[int, int], end: tuple[int, int]) -> set[tuple[int, int]]:
    """Cells under many points of the line between two cells' centres."""
    cells = set()
    for step in range(2001):
        t = step / 2000
        x = start[0] + t * (end[0] - start[0])
        y = start[1] + t * (end[1] - start[1])
        edge = min(abs(x - math.floor(x) - 0.5), abs(y - math.floor(y) - 0.5))
        if edge > 1e-6:  # on the border of two cells it belongs to neither
            cells.add((math.floor(x + 0.5), math.floor(y + 0.5)))
    return cells


def top_cells(similarity: F32, percentile: float) -> Bool:
    """Cells that at least ``percentile`` percent of the observed cells do not exceed."""
    values = sorted(float(v) for v in similarity.ravel() if not math.isnan(v))
    top = np.zeros(similarity.shape, bool)
    for cell in np.ndindex(similarity.shape):
        value = float(similarity[cell])
        if math.isnan(value):
            continue
        rank = (len(values) - 1) * percentile / 100  # linear between the two nearest ranks
        low = values[math.floor(rank)]
        high = values[math.ceil(rank)]
        top[cell] = value >= low + (high - low) * (rank - math.floor(rank)) - 1e-9
    return top


def clearances(occupied: Bool, cell_size_m: float) -> F64:
    """Metres from each cell's centre to the edge of the nearest occupied cell's inner circle."""
    places = np.argwhere(occupied)
    away = np.full(occupied.shape, np.inf)
    for cell in np.ndindex(occupied.shape):
        for place in places:
            away[cell] = min(away[cell], math.dist(cell, place) * cell_size_m - cell_size_m / 2)
    return away


def similarity_beyond(similarity: F32, unexplored: Bool, decay_per_cell: float) -> F64:
    """The highest similarity of each unexplored cell, less the way to it through such cells."""
    best = np.where(unexplored, np.nan_to_num(similarity).astype(np.float64), 0.0)
    for start in map(tuple, np.argwhere(unexplored)):
        ways = dijkstra(np.where(unexplored, 1.0, -1.0), start)
        best[start] = max(0.0, float((best - decay_per_cell * ways)[unexplored].max()))
    return best


def area_in_view(occupied: Bool, wanted: Bool, viewpoint: I64, rays: int, steps: int) -> float:
    """Wanted cells, and those outside the grid, in sight along rays; each counts for the part of
    the ring, in cells, that its ray stands for."""
    area = 0.0
    for ray in range(rays):
        angle = 2 * math.pi * ray / rays
        for step in range(1, steps + 1):
            x = int(viewpoint[0]) + round(step * math.cos(angle))
            y = int(viewpoint[1]) + round(step * math.sin(angle))
            inside = 0 <= x < occupied.shape[0] and 0 <= y < occupied.shape[1]
            if inside and occupied[x, y]:
                break
            if not inside or wanted[x, y]:
                area += 2 * math.pi / rays * step
    return area


def nearest_of(mask: Bool, cell: I64) -> tuple[float, tuple[int, int]]:
    """Distance in cells to the nearest true cell, and that: of several the first by y, then x."""
    away = ((math.dist(cell, (x, y)), y, x) for x, y in np.argwhere(mask).tolist())
    distance, y, x = min(away, default=(math.inf, -1, -1))
    return distance, (x, y)
