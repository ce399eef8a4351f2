"""Where in height the regions of an answer and found objects lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_mapper.heights import height_band, surroundings
from onemap_mapper.map_version import NO_SLOT, MapVersion
from onemap_mapper.verdicts import area_mask
from onemap_shared.geometry import F32, I64, Bool

Extent = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max, metres


def region_bands(version: MapVersion, regions: Sequence[I64], scores: F32) -> F32:
    """Lowest and highest height (n, 2) in metres of regions; NaN: nothing is known of it.

    regions: cells (k, 2) of each, of the map's grid; scores (nx, ny): by which they match.
    """
    anyone = np.zeros(version.grid.shape, bool)
    for cells in regions:
        anyone[tuple(cells.T)] = True
    bands = []
    for cells in regions:
        around = _around(version, anyone, cells)
        bands.append(height_band(_shares(version, cells), scores[tuple(cells.T)], around))
    return np.array(bands, np.float32).reshape(-1, 2)


def extent_band(version: MapVersion, extent_m: Extent) -> tuple[float, ...]:
    """Lowest and highest height in metres of what lies there; empty: nothing is known of it."""
    inside = area_mask(version.grid, extent_m)
    if inside is None or not inside.any():
        return ()
    cells = np.argwhere(inside)
    low, high = region_bands(version, [cells], np.ones(version.grid.shape, np.float32))[0].tolist()
    return () if np.isnan(low) else (low, high)


def _around(version: MapVersion, regions: Bool, cells: I64) -> F32:
    return _shares(version, surroundings(regions, cells))


def _shares(version: MapVersion, cells: I64) -> F32:
    """Shares (k, LEVELS) of height of cells (k, 2) of the map's grid, 0 where not observed."""
    rows = version.tiles.rows(cells + version.grid.origin_cell)
    slots = np.where(rows >= 0, version.slots[rows], NO_SLOT)
    shares: F32 = np.zeros((len(cells), version.heights.shape[1]), np.float32)
    shares[slots != NO_SLOT] = version.heights_of(slots[slots != NO_SLOT])
    return shares
