"""Goals that were given up are offered again once obstacles around them have come or gone.

What was in the way may have been a person, a chair or a closed door. Unknown floor that becomes
known is no such change: then the border lies elsewhere and is another goal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import U8
from onemap_shared.messages import Occupancy

DEAD_END_AROUND_M = 1.0  # metres around it, on all sides, in which changes count: a door
# Square metres that have become free or occupied: half a person; noise at the rims of furniture
# changes less.
DEAD_END_CHANGED_M2 = 0.3
# How often one place is offered again in a search, also a candidate to which the way was closed:
# people who walk through a room change it all the time.
DEAD_END_RETURNS = 2


@dataclass(frozen=True, slots=True)
class DeadEnd:
    """A place, metres, with its surroundings when it was given up: occupancy uint8, row by row.

    returns: how often it was offered again before; open: whether it is offered now.
    """

    xy: tuple[float, float]
    occupancy: bytes
    returns: int = 0
    open: bool = False


def updated_dead_ends(
    dead_ends: tuple[DeadEnd, ...], given_up_xy: tuple[tuple[float, float], ...], map_view: MapView
) -> tuple[DeadEnd, ...]:
    """The dead ends of these places: a new one with its surroundings as they are, a known one
    open if they have changed. Open ones are kept, for the number of their returns."""
    known = {dead_end.xy: dead_end for dead_end in dead_ends}
    kept = [dead_end for dead_end in dead_ends if dead_end.open and dead_end.xy not in given_up_xy]
    for xy in dict.fromkeys(given_up_xy):
        before = known.get(xy)
        if before is None or before.open:
            near = [
                d.returns + 1 for d in dead_ends if d.open and _near(d.xy, xy, DEAD_END_AROUND_M)
            ]
            patch = surroundings(map_view, xy)
            kept.append(DeadEnd(xy, patch.tobytes(), max(near, default=0)))
        elif before.returns < DEAD_END_RETURNS and _changed(before, map_view):
            kept.append(replace(before, open=True))
        else:
            kept.append(before)
    return tuple(kept)


def surroundings(map_view: MapView, xy: tuple[float, float]) -> U8:
    """Occupancy (n, n) uint8 of the square around a place; unknown outside of the view."""
    reach = int(DEAD_END_AROUND_M / map_view.grid.cell_size_m)
    patch = np.full((2 * reach + 1, 2 * reach + 1), Occupancy.UNKNOWN, np.uint8)
    first = map_view.grid.cells(np.asarray(xy)) - reach
    lower = np.clip(first, 0, map_view.grid.shape)
    upper = np.clip(first + len(patch), 0, map_view.grid.shape)
    (x0, y0), (x1, y1) = lower, upper
    a, b = lower - first
    patch[a : a + x1 - x0, b : b + y1 - y0] = map_view.occupancy[x0:x1, y0:y1]
    return patch


def _changed(dead_end: DeadEnd, map_view: MapView) -> bool:
    now = surroundings(map_view, dead_end.xy)
    then = np.frombuffer(dead_end.occupancy, np.uint8).reshape(now.shape)
    both_known = (now != Occupancy.UNKNOWN) & (then != Occupancy.UNKNOWN)
    area_m2 = float((both_known & (now != then)).sum()) * map_view.cell_area_m2
    return area_m2 >= DEAD_END_CHANGED_M2


def _near(one: tuple[float, float], other: tuple[float, float], within_m: float) -> bool:
    return float(np.hypot(one[0] - other[0], one[1] - other[1])) <= within_m
