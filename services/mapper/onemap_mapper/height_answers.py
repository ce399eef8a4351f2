"""Where in height the regions of an answer and found objects lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_mapper.belief_map import NO_SLOT, BeliefMap
from onemap_mapper.heights import height_band, surroundings
from onemap_mapper.verdicts import area_mask
from onemap_shared.geometry import F32, I64, Bool

Extent = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max, metres


def region_bands(belief: BeliefMap, regions: Sequence[I64], scores: F32) -> F32:
    """Lowest and highest height (n, 2) in metres of regions; NaN: nothing is known of it.

    regions: cells (k, 2) of each, of the map's grid; scores (nx, ny): by which they match.
    """
    anyone = np.zeros(belief.grid.shape, bool)
    for cells in regions:
        anyone[tuple(cells.T)] = True
    bands = [
        height_band(_shares(belief, cells), scores[tuple(cells.T)], _around(belief, anyone, cells))
        for cells in regions
    ]
    return np.array(bands, np.float32).reshape(-1, 2)


def extent_band(belief: BeliefMap, extent_m: Extent) -> tuple[float, ...]:
    """Lowest and highest height in metres of what lies there; empty: nothing is known of it."""
    inside = area_mask(belief.grid, extent_m)
    if inside is None or not inside.any():
        return ()
    cells = np.argwhere(inside)
    low, high = region_bands(belief, [cells], np.ones(belief.grid.shape, np.float32))[0].tolist()
    return () if np.isnan(low) else (low, high)


def _around(belief: BeliefMap, regions: Bool, cells: I64) -> F32:
    return _shares(belief, surroundings(regions, cells))


def _shares(belief: BeliefMap, cells: I64) -> F32:
    """Shares (k, LEVELS) of height of cells (k, 2) of the map's grid, 0 where not observed."""
    rows = belief.tiles.rows(cells + belief.grid.origin_cell)
    slots = np.where(rows >= 0, belief.slots.values[rows], NO_SLOT).astype(np.int64)
    shares = belief.store.heights(np.maximum(slots, 0))
    shares[slots == NO_SLOT] = 0.0
    return shares
