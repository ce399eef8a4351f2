"""Where to stand to look at something."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_planner.path import Reach, line_is_clear
from onemap_planner.terrain import EIGHT, Terrain
from onemap_shared.geometry import F64, I64, Bool

MAX_TRIES = 80  # lines of sight tried per target, cheapest stands first
BLUR_CELLS = 2  # the map blurs: cells this close to the target belong to it, not before it


def reachable(terrain: Terrain, reach: Reach) -> Bool:
    """Mask (nx, ny) of the cells of N that a path leads to."""
    mask: Bool = terrain.navigable & np.isfinite(reach.cost_m)
    return mask


def view_stand(
    target: I64,
    terrain: Terrain,
    reach: Reach,
    *,
    band_m: tuple[float, float],
    seen_from: I64 | None = None,
) -> I64 | None:
    """The cheapest reachable cell (2,) that sees the target cells (K, 2) from within the band.

    Distances are to the nearest target cell. A stand sees the target if no obstacle lies
    between, or, given ``seen_from`` (S, 2), if it lies in a direction the target was seen
    from: flat maps cannot tell that one looks over a table at the cup behind it.
    """
    corner, box = _window(target, terrain, band_m[1])
    mask = np.zeros(terrain.occupied[box].shape, bool)
    local = target - corner
    mask[local[:, 0], local[:, 1]] = True
    distance, nearest = ndimage.distance_transform_edt(~mask, return_indices=True)
    distance = distance * terrain.grid.cell_size_m
    cost = np.where(reachable(terrain, reach)[box], reach.cost_m[box], np.inf)
    cost[(distance < band_m[0]) | (distance > band_m[1])] = np.inf
    stands = np.argwhere(np.isfinite(cost))
    order = np.argsort(cost[stands[:, 0], stands[:, 1]], kind="stable")
    own = ndimage.binary_dilation(mask, EIGHT, iterations=BLUR_CELLS)
    clear = ~terrain.occupied[box] | own
    if seen_from is not None:
        seen_from = seen_from - corner
    for stand in _spread(stands[order]):
        look = nearest[:, stand[0], stand[1]]
        if line_is_clear(clear, stand, look) or (
            seen_from is not None and _same_side(stand, look, seen_from)
        ):
            seen: I64 = stand + corner
            return seen
    return None


def _spread(stands: I64) -> I64:
    """At most ``MAX_TRIES`` of the stands (N, 2), evenly chosen, in their order."""
    if len(stands) <= MAX_TRIES:
        return stands
    chosen: I64 = stands[np.linspace(0, len(stands) - 1, MAX_TRIES).astype(int)]
    return chosen


def _window(target: I64, terrain: Terrain, reach_m: float) -> tuple[I64, tuple[slice, slice]]:
    """First cell (2,) and slices of the part of the grid within ``reach_m`` of the target."""
    around = int(np.ceil(reach_m / terrain.grid.cell_size_m)) + BLUR_CELLS
    lower = np.maximum(target.min(axis=0) - around, 0)
    upper = np.minimum(target.max(axis=0) + around + 1, terrain.grid.shape)
    return lower, (slice(lower[0], upper[0]), slice(lower[1], upper[1]))


def _same_side(stand: I64, look: I64, seen_from: I64) -> bool:
    """Whether the stand lies within 45 degrees of a direction the target was seen from."""
    towards = (stand - look).astype(float)
    seen: F64 = (seen_from - look).astype(float)
    norms = np.hypot(*towards) * np.hypot(seen[:, 0], seen[:, 1])
    return bool((seen @ towards >= np.cos(np.pi / 4) * norms).any())
