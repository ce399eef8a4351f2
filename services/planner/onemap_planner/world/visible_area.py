"""Area that could be seen from a place: what a frontier there may show."""

from __future__ import annotations

import numpy as np

from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.messages import Occupancy

RAYS = 48  # 7.5 degrees: a door of 0.8 m at 3 m is two rays wide


def area_in_view(map_view: MapView, wanted: Bool, viewpoints: I64, range_m: float) -> F64:
    """Area (V,) in square metres of wanted cells within ``range_m`` in sight of cells (V, 2).

    wanted (nx, ny): cells that count; outside the grid all do. Rays run in all directions through
    free and unknown cells and end at occupied ones.
    """
    steps = np.arange(1, int(range_m / map_view.grid.cell_size_m) + 1)
    angles = 2 * np.pi * np.arange(RAYS) / RAYS
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    offsets = np.rint(directions[:, None] * steps[:, None]).astype(np.int64)
    cells = viewpoints[:, None, None] + offsets  # (V, RAYS, steps, 2)
    inside = map_view.grid.contains(cells)
    limit = np.asarray(map_view.grid.shape) - 1
    x, y = np.moveaxis(np.clip(cells, 0, limit), -1, 0)
    occupied = inside & (map_view.occupancy[x, y] == Occupancy.OCCUPIED)
    in_sight = ~np.maximum.accumulate(occupied, axis=-1)
    ring_m2 = 2 * np.pi / RAYS * steps * map_view.cell_area_m2  # of one ray's step
    area: F64 = ((in_sight & (wanted[x, y] | ~inside)) * ring_m2).sum(axis=(-2, -1))
    return area
