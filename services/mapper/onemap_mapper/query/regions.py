"""Regions of an answer: connected cells, ranked, their outlines, and at which heights they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from onemap_mapper.belief.version import NO_SLOT, MapVersion
from onemap_mapper.occupancy.heights import height_band, surroundings
from onemap_mapper.query.similarity import TOP_CELLS
from onemap_shared.geometry import F32, I64, Bool
from onemap_shared.grid import GridSpec, area_mask

# A cell's sides, from corner to corner counter-clockwise, and its neighbour beyond each.
SIDES = (
    ((0, 0), (1, 0), (0, -1)),
    ((1, 0), (1, 1), (1, 0)),
    ((1, 1), (0, 1), (0, 1)),
    ((0, 1), (0, 0), (-1, 0)),
)


def outline(cells: I64, grid: GridSpec) -> F32:
    """Corners (P, 2) in metres of the polygon around 8-connected cells (K, 2), counter-clockwise.

    The first corner is not repeated. Holes are filled; cells that touch at a corner alone are
    joined by the cells beside it, so that the polygon never touches itself.
    """
    low = cells.min(axis=0) - 1
    mask = np.zeros(tuple(cells.max(axis=0) - low + 2), bool)
    mask[tuple((cells - low).T)] = True
    mask = ndimage.binary_fill_holes(_without_diagonals(mask))
    corners = _loop(mask)
    world = corners + low + np.asarray(grid.origin_cell)
    metres: F32 = (world * grid.cell_size_m).astype(np.float32)
    return metres


def _without_diagonals(mask: Bool) -> Bool:
    """The mask with every block of two by two filled that only holds a diagonal."""
    filled: Bool = mask.copy()
    while True:
        a, b, c, d = filled[:-1, :-1], filled[1:, 1:], filled[1:, :-1], filled[:-1, 1:]
        diagonal = (a & b & ~c & ~d) | (~a & ~b & c & d)
        if not diagonal.any():
            return filled
        for x in (0, 1):
            for y in (0, 1):
                nx, ny = diagonal.shape
                filled[x : x + nx, y : y + ny] |= diagonal


def _loop(mask: Bool) -> I64:
    """Corners (P, 2) around the only part of a mask without holes, where the direction changes."""
    after: dict[tuple[int, int], tuple[int, int]] = {}
    for start, end, (dx, dy) in SIDES:
        cells = np.argwhere(mask & ~np.roll(mask, (-dx, -dy), (0, 1)))
        for (x, y), (x_end, y_end) in zip(
            (cells + start).tolist(), (cells + end).tolist(), strict=True
        ):
            after[x, y] = (x_end, y_end)
    first = min(after)
    loop, here = [first], after[first]
    while here != first:
        loop.append(here)
        here = after[here]
    points = np.array(loop)
    turns = np.any(
        np.diff(points, axis=0, append=points[:1]) != np.diff(points, axis=0, prepend=points[-1:]),
        axis=1,
    )
    return points[turns]


BEST_SHARE = 0.5  # of the best score, that a region's cells have at least
TOP_SHARE = 0.05  # of all cells: the paper's top 5 percentile
EIGHT_NEIGHBOURS = np.ones((3, 3), bool)


@dataclass(frozen=True, slots=True)
class Regions:
    """Clusters of high score, best first, all float32; metres in the map frame.

    centres_m (n, 2) score-weighted; extents_m (n, 4) x_min, y_min, x_max, y_max of the
    cells' outlines; scores (n,) in [0, 1]; variances (n,) the mean of 1 / c. cells: of each region
    (K, 2) int64.
    """

    centres_m: F32
    extents_m: F32
    scores: F32
    variances: F32
    cells: tuple[I64, ...]

    def taken(self, order: Sequence[int]) -> Regions:
        """The regions of these indices."""
        index = np.array(order, np.int64)
        return Regions(
            self.centres_m[index],
            self.extents_m[index],
            self.scores[index],
            self.variances[index],
            tuple(self.cells[k] for k in order),
        )


NO_REGIONS = Regions(
    np.zeros((0, 2), np.float32),
    np.zeros((0, 4), np.float32),
    np.zeros(0, np.float32),
    np.zeros(0, np.float32),
    (),
)


def region_threshold(values: F32, *, calibrated: bool) -> float:
    """The lowest score of a region's cells, from the scores (n,) of all observed cells.

    A share of the best score, and among the highest if they are not calibrated: scores that are no
    probabilities lie so close together that a share of the best excludes little.
    """
    limit = BEST_SHARE * float(values.max())
    if not calibrated:
        limit = max(limit, float(np.quantile(values, 1.0 - TOP_SHARE)))
    return limit


def find_regions(
    scores: F32, variances: F32, grid: GridSpec, *, limit: float, max_regions: int
) -> Regions:
    """Eight-connected clusters of cells with score >= limit > 0, the best ``max_regions``.

    scores and variances (nx, ny) float32, NaN = not observed. Regions rank by the
    mean of their ``TOP_CELLS`` best scores, then by size; centres are weighted by score.
    """
    labels, count = ndimage.label(np.nan_to_num(scores, nan=-1.0) >= limit, EIGHT_NEIGHBOURS)
    cells = np.argwhere(labels)
    owner = labels[tuple(cells.T)] - 1
    score, variance = (grids[tuple(cells.T)].astype(np.float64) for grids in (scores, variances))
    size = np.bincount(owner, minlength=count)
    weight = np.bincount(owner, score, count)
    centres = grid.centres(cells)
    mean_centres = [np.bincount(owner, score * centres[:, k], count) / weight for k in range(2)]
    ranked = _top_mean(owner, score, count)
    best = np.lexsort((-size, -ranked))[:max_regions]
    return Regions(
        np.stack(mean_centres, axis=1)[best].astype(np.float32),
        _extents(cells, owner, count, grid)[best],
        ranked[best].astype(np.float32),
        (np.bincount(owner, variance, count) / size)[best].astype(np.float32),
        tuple(cells[owner == number] for number in best),
    )


def scoring_at_least(regions: Regions, min_score: float) -> Regions:
    """The regions that score at least ``min_score``."""
    return regions.taken(np.flatnonzero(regions.scores >= np.float32(min_score)).tolist())


def scored_by(regions: Regions, scores: F32) -> Regions:
    """The regions with the mean of their ``TOP_CELLS`` best of other scores (nx, ny)."""
    best = [np.sort(np.nan_to_num(scores[tuple(each.T)]))[-TOP_CELLS:] for each in regions.cells]
    return replace(regions, scores=np.array([each.mean() for each in best], np.float32))


def _top_mean(owner: I64, score: np.ndarray, count: int) -> np.ndarray:
    """Mean of the TOP_CELLS best scores of each region, of all if it has fewer."""
    order = np.lexsort((-score, owner))
    first = np.searchsorted(owner[order], np.arange(count))
    rank = np.arange(len(order)) - first[owner[order]]
    top = order[rank < TOP_CELLS]
    mean: np.ndarray = np.bincount(owner[top], score[top], count) / np.bincount(
        owner[top], minlength=count
    )
    return mean


def _extents(cells: I64, owner: I64, count: int, grid: GridSpec) -> F32:
    low = np.full((count, 2), np.iinfo(np.int64).max)
    high = np.full((count, 2), np.iinfo(np.int64).min)
    np.minimum.at(low, owner, cells)
    np.maximum.at(high, owner, cells)
    half = 0.5 * grid.cell_size_m
    corners = np.concatenate([grid.centres(low) - half, grid.centres(high) + half], axis=1)
    return corners.astype(np.float32)


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
    low, high = region_bands(version, [cells], np.broadcast_to(np.float32(1), version.grid.shape))[
        0
    ].tolist()
    return () if np.isnan(low) else (low, high)


def _around(version: MapVersion, regions: Bool, cells: I64) -> F32:
    return _shares(version, surroundings(regions, cells))


def _shares(version: MapVersion, cells: I64) -> F32:
    """Shares (k, LEVELS) of height of cells (k, 2) of the map's grid, 0 where not observed."""
    rows = version.tiles.rows(cells + version.grid.origin_cell)
    slots = np.where(rows >= 0, version.slots[rows], NO_SLOT)
    shares: F32 = np.zeros((len(cells), version.heights.shape[1]), np.float32)
    shares[slots != NO_SLOT] = version.heights[slots[slots != NO_SLOT]]
    return shares
