"""Regions of high similarity: connected cells, ranked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import F32, I64
from onemap_shared.grid import GridSpec

TOP_CELLS = 3  # a region's score is the mean of its best cells: one cell alone may be noise
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


NO_REGIONS = Regions(
    np.zeros((0, 2), np.float32),
    np.zeros((0, 4), np.float32),
    np.zeros(0, np.float32),
    np.zeros(0, np.float32),
    (),
)


def region_threshold(values: F32, *, best_share: float, top_share: float | None) -> float:
    """The lowest score of a region's cells, from the scores (n,) of all observed cells.

    ``best_share`` of the best score, and among the ``top_share`` highest if given: scores that are
    no probabilities lie so close together that a share of the best excludes little.
    """
    limit = best_share * float(values.max())
    if top_share is not None:
        limit = max(limit, float(np.quantile(values, 1.0 - top_share)))
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
    kept = regions.scores >= np.float32(min_score)
    return Regions(
        regions.centres_m[kept],
        regions.extents_m[kept],
        regions.scores[kept],
        regions.variances[kept],
        tuple(cells for cells, keep in zip(regions.cells, kept, strict=True) if keep),
    )


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
