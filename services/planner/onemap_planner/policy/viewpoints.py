"""Viewpoints: reachable cells from which a target can be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy import ndimage

from onemap_planner.motion.path import lengths_over
from onemap_planner.policy.context import APPROACH_LIMIT_M, PlanningContext
from onemap_planner.world.candidates import SAME_SIDE_M, ObjectCandidate
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64, I64, Bool

MAX_TRIES = 80  # lines of sight tried per target, cheapest viewpoints first
TRIED_M = 0.7  # a viewpoint nearer than this to a tried one shows nothing new
NO_CELLS: I64 = np.zeros((0, 2), np.int64)
OTHER_SIDE_M = 1.2 * SAME_SIDE_M  # the robot may stop a little off
BLOCK = np.ones((3, 3), np.uint8)
BLUR_CELLS = 2  # the map is blurred: obstacles this close to the target belong to it


@dataclass(frozen=True, slots=True)
class SightTarget:
    """What is looked at: its cells (K, 2), and those that it was seen from (S, 2), if known."""

    cells: I64
    seen_from: I64 = field(default_factory=lambda: NO_CELLS)


@dataclass(frozen=True, slots=True)
class Viewpoints:
    """Reachable cells from which a target may be seen, cheapest first, at most ``MAX_TRIES``.

    Indices count from ``corner`` (2,). cells (N, 2): the viewpoints; look (N, 2): the target
    cell nearest to each; seen_from (S, 2): where it was seen from; obstructed (nx, ny): obstacles
    that do not belong to the target.
    """

    corner: I64
    cells: I64
    look: I64
    seen_from: I64
    obstructed: Bool


def viewpoints_around(
    target: SightTarget,
    context: PlanningContext,
    band_m: tuple[float, float],
    *,
    tried: I64 = NO_CELLS,
    apart_m: float = TRIED_M,
) -> Viewpoints:
    """Viewpoints before the target whose distance to its nearest cell lies in the band.

    tried (T, 2): earlier viewpoints; none within ``apart_m`` of them is returned.
    """
    costmap, cost_m = context.costmap, context.cost_to_go.cost_m
    corner, box = _window(target.cells, costmap, band_m[1])
    size = costmap.grid.cell_size_m
    mask = np.zeros(costmap.occupied[box].shape, bool)
    local, seen_from = target.cells - corner, target.seen_from - corner
    mask[local[:, 0], local[:, 1]] = True
    cells, nearest = ndimage.distance_transform_edt(~mask, return_indices=True)
    stand = costmap.navigable[box] & (cells * size >= band_m[0]) & (cells * size <= band_m[1])
    target = SightTarget(local, seen_from)
    if _unknown_before(target, costmap.free[box], costmap.occupied[box]):
        stand = np.zeros_like(stand)
    else:
        stand = _before(target, cells, costmap.free[box], stand)
    viewpoints = np.argwhere(stand & np.isfinite(cost_m[box]))
    away = np.hypot(*(viewpoints[:, None] + corner - tried[None]).transpose(2, 0, 1)) * size
    viewpoints = viewpoints[(away > apart_m).all(axis=1)]
    cost = cost_m[box][viewpoints[:, 0], viewpoints[:, 1]]
    viewpoints = _spread(viewpoints[np.argsort(cost, kind="stable")])
    own = _grown(mask)
    look: I64 = nearest[:, viewpoints[:, 0], viewpoints[:, 1]].T.astype(np.int64)
    return Viewpoints(corner, viewpoints, look, seen_from, costmap.occupied[box] & ~own)


def first_visible(around: Viewpoints) -> I64 | None:
    """The cheapest viewpoint (2,) from which the target is visible; None if there is none.

    It is visible if no obstacle lies between, or from the directions from which it was seen: a
    2-D map does not show that the camera looks over a table at a cup behind it.
    """
    hidden = lengths_over(around.obstructed, around.cells, around.look) > 0
    for occluded, viewpoint, look in zip(hidden, around.cells, around.look, strict=True):
        if not occluded or seen_from_side(viewpoint, look, around.seen_from):
            cell: I64 = viewpoint + around.corner
            return cell
    return None


def least_occluded(around: Viewpoints) -> I64 | None:
    """The viewpoint (2,) with the fewest obstacles before the target; None if there is none.

    On a 2-D map an object deep on a counter is occluded from everywhere.
    """
    if len(around.cells) == 0:
        return None
    hidden = lengths_over(around.obstructed, around.cells, around.look)
    best: I64 = around.cells[int(np.argmin(hidden))] + around.corner
    return best


def find_viewpoint(
    candidate: ObjectCandidate,
    context: PlanningContext,
    tried_xy: Sequence[tuple[float, float]] = (),
) -> tuple[float, float] | None:
    """The viewpoint (metres) of a candidate; None if none can be reached.

    tried_xy: metres, none near these, and none from which it is hidden, if there are any. Of a
    candidate that the map does not support, only another side shows anything new. One that it
    supports is seen from farther away where the robot does not fit nearer.
    """
    cells = context.map_view.indices_of(candidate.surface)
    if len(cells) == 0:
        return None
    costmap = context.costmap
    seen_from = costmap.grid.cells(np.asarray(candidate.seen_from))
    target = SightTarget(_occupied_only(cells, costmap), seen_from)
    tried = costmap.grid.cells(np.array(tried_xy, np.float64).reshape(-1, 2))
    apart_m = TRIED_M if candidate.supported else OTHER_SIDE_M
    bands_m = context.bands.at(candidate.xyz[2])
    for band_m in bands_m if candidate.supported else bands_m[:-1]:
        # Beyond, not over whatever it was seen over: somebody may stand in that door by now.
        seen = target if band_m[1] < APPROACH_LIMIT_M else SightTarget(target.cells)
        around = viewpoints_around(seen, context, band_m, tried=tried, apart_m=apart_m)
        viewpoint = first_visible(around)
        if viewpoint is not None:
            return context.xy_of(viewpoint)
    if len(tried):
        return None
    viewpoint = least_occluded(viewpoints_around(target, context, bands_m[-2]))
    return None if viewpoint is None else context.xy_of(viewpoint)


def surface_distance_m(candidate: ObjectCandidate, context: PlanningContext) -> float:
    """Metres from the robot to the nearest cell of a candidate's surface, infinity without any."""
    cells = _occupied_only(context.map_view.indices_of(candidate.surface), context.costmap)
    here = np.asarray(context.pose.xy)
    away = np.hypot(*(context.costmap.grid.centres(cells) - here).T)
    return float(away.min(initial=np.inf))


def _occupied_only(cells: I64, costmap: Costmap) -> I64:
    """The occupied ones of the cells (K, 2), all of them if none is.

    The rim of a detection covers floor before the object, which is not its surface.
    """
    solid = cells[costmap.occupied[cells[:, 0], cells[:, 1]]]
    return solid if len(solid) else cells


def _spread(viewpoints: I64) -> I64:
    """At most ``MAX_TRIES`` of the viewpoints (N, 2), evenly chosen, in their order."""
    if len(viewpoints) <= MAX_TRIES:
        return viewpoints
    chosen: I64 = viewpoints[np.linspace(0, len(viewpoints) - 1, MAX_TRIES).astype(int)]
    return chosen


def _window(target: I64, costmap: Costmap, reach_m: float) -> tuple[I64, tuple[slice, slice]]:
    """First cell (2,) and slices of the part of the grid within ``reach_m`` of the target."""
    around = int(np.ceil(reach_m / costmap.grid.cell_size_m)) + BLUR_CELLS
    lower = np.maximum(target.min(axis=0) - around, 0)
    upper = np.minimum(target.max(axis=0) + around + 1, costmap.grid.shape)
    return lower, (slice(lower[0], upper[0]), slice(lower[1], upper[1]))


def _before(target: SightTarget, away: F64, free: Bool, stand: Bool) -> Bool:
    """Which of the places ``stand`` (nx, ny) are on the floor before a target.

    What stands against a wall is not seen from the next room, though the flat and blurred map has
    nothing but a thin wall between. The floor before it is all over which it was seen; else the
    nearest, or all that is within a cell of it. away (nx, ny): cells to the target. All places, if
    none is there.
    """
    _, floors = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    if len(target.seen_from):
        before = _floors_seen_over(target, floors.astype(np.int64))
    else:
        nearest = float(away[free].min(initial=np.inf))
        before = np.unique(floors[free & (away <= nearest + 1)])
    there: Bool = stand & np.isin(floors, before)
    return there if there.any() else stand


def _floors_seen_over(target: SightTarget, floors: I64) -> I64:
    """Numbers of the floors that the lines of sight to the target cross, without repetition.

    floors (nx, ny): number of the connected floor of each cell, 0 where there is none.
    """
    x, y = _seen_over(target, floors.shape).T
    numbers: I64 = np.unique(floors[x, y])
    return numbers[numbers > 0]


def _unknown_before(target: SightTarget, free: Bool, occupied: Bool) -> bool:
    """Whether the target was seen over unknown cells, and over no floor: the way to it is not
    known yet, and what the map has on other sides of it may be behind a wall."""
    x, y = _seen_over(target, free.shape).T
    return bool((~free & ~occupied)[x, y].any() and not free[x, y].any())


def _seen_over(target: SightTarget, shape: tuple[int, ...]) -> I64:
    """Cells (N, 2), inside the shape, on the lines of sight to the target."""
    cells = target.cells
    middle = cells[np.hypot(*(cells - cells.mean(axis=0)).T).argmin()]
    lines = [np.zeros((0, 2), np.int64)]
    for place in target.seen_from:
        steps = 2 * int(np.abs(place - middle).max()) + 1
        lines.append(np.rint(np.linspace(middle, place, steps)).astype(np.int64))
    line = np.concatenate(lines)
    inside: I64 = line[((line >= 0) & (line < shape)).all(axis=1)]
    return inside


def own_cells(target: I64, shape: tuple[int, int]) -> Bool:
    """Mask (nx, ny) of the cells where obstacles belong to a target with the cells (K, 2)."""
    mask = np.zeros(shape, bool)
    mask[target[:, 0], target[:, 1]] = True
    return _grown(mask)


def _grown(mask: Bool) -> Bool:
    return cv2.dilate(mask.astype(np.uint8), BLOCK, iterations=BLUR_CELLS) > 0


def seen_from_side(viewpoint: I64, look: I64, seen_from: I64) -> bool:
    """Whether the viewpoint is within 45 degrees of a direction the target was seen from."""
    towards = (viewpoint - look).astype(float)
    seen: F64 = (seen_from - look).astype(float)
    norms = np.hypot(*towards) * np.hypot(seen[:, 0], seen[:, 1])
    return bool((seen @ towards >= np.cos(np.pi / 4) * norms).any())
