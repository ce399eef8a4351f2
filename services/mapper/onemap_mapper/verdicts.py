"""The verdict of an answer: found, not here, or not looked yet. docs/queries.md has the rule."""

from __future__ import annotations

import numpy as np

from onemap_mapper.coverage import FloorCoverage
from onemap_mapper.params import VerdictParams
from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import MapVerdict, Verdict

HINT_M = 1.5  # around a frontier, whose likeness to the object says what may be beyond
VIEW_SCALE_M2 = 5.0  # of unknown area in sight for 63 percent of its worth: a door shows 5 and more
WORTH_PER_M = 0.04  # that a frontier loses per metre to it, as in a search


def judge(
    best_score: float,
    coverage: FloorCoverage,
    *,
    worths: F64,
    params: VerdictParams,
) -> MapVerdict:
    """The verdict about an object of which the best region has this score.

    worths (n,): of looking behind each frontier of the coverage.
    """
    if best_score >= params.found_score:
        verdict = Verdict.FOUND
    elif coverage.share >= params.looked_share:
        verdict = Verdict.NOT_HERE
    else:
        verdict = Verdict.NOT_LOOKED_YET
    frontier_m: tuple[float, ...] = ()
    if len(worths):
        x_m, y_m = coverage.frontiers_m[int(worths.argmax())]
        frontier_m = (float(x_m), float(y_m))
    return MapVerdict(
        verdict,
        looked_m2=coverage.looked_m2,
        not_looked_m2=coverage.not_looked_m2,
        frontiers=len(worths),
        frontier_m=frontier_m,
    )


def frontier_worths(
    coverage: FloorCoverage, cosines: F32, grid: GridSpec, *, robot_xy_m: tuple[float, ...]
) -> F64:
    """What looking behind each frontier (n,) is worth.

    More unknown area in sight, surroundings more like the object and a shorter way, as the crow
    flies, make it worth more. cosines (nx, ny): of the object, NaN where nothing was observed.
    """
    observed = np.sort(cosines[np.isfinite(cosines)])
    worths = 1.0 - np.exp(-coverage.unseen_m2 / VIEW_SCALE_M2)
    reach = round(HINT_M / grid.cell_size_m)
    for index, place in enumerate(coverage.frontiers_m):
        x, y = grid.cells(place)
        around = cosines[max(x - reach, 0) : x + reach + 1, max(y - reach, 0) : y + reach + 1]
        if np.isfinite(around).any():
            rank = np.searchsorted(observed, np.nanmean(around)) / len(observed)
            worths[index] *= 0.5 + rank
        if robot_xy_m:
            worths[index] -= WORTH_PER_M * np.linalg.norm(place - np.asarray(robot_xy_m))
    return worths


def area_mask(grid: GridSpec, area_m: tuple[float, ...]) -> Bool | None:
    """Cells (nx, ny) whose centres lie in x_min, y_min, x_max, y_max; None for an empty area."""
    if not area_m:
        return None
    x_min, y_min, x_max, y_max = area_m
    nx, ny = grid.shape
    x = grid.centres(np.stack([np.arange(nx), np.zeros(nx, np.int64)], axis=1))[:, 0]
    y = grid.centres(np.stack([np.zeros(ny, np.int64), np.arange(ny)], axis=1))[:, 1]
    inside: Bool = ((x >= x_min) & (x <= x_max))[:, None] & ((y >= y_min) & (y <= y_max))
    return inside
