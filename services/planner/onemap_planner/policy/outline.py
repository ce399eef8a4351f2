"""Looks at the outline of a room: whether a wall parts a candidate from the point of its name.

What was seen through a door is in the same room as the floor before it, until the walls beside the
door are seen. Nothing near the candidate tells which it is, but the unseen cells between both do.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import ndimage

from onemap_planner.motion.path import cost_to_go_from_any
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import GIVEN_UP_RADIUS_M, Goal, GoalKind, GoalUtility
from onemap_planner.policy.ledger import Ledger
from onemap_planner.policy.viewpoints import SightTarget, first_visible, viewpoints_around
from onemap_planner.policy.ways import FLOOR_FARTHEST_M
from onemap_planner.sentences import WALLS
from onemap_planner.world.candidates import ObjectCandidate
from onemap_planner.world.description import Description
from onemap_shared.geometry import I64, Bool
from onemap_shared.grid import onto
from onemap_shared.messages import NO_ROOM, Occupancy
from onemap_shared.places import SPECK_M, place_mask, place_of

OPEN_COST, WALL_COST = 5.0, 50.0  # of a cell where a wall may be, and of one where something stands
DOOR_M = 1.7  # from a cell where a wall may be to the unseen cells that make it one: a passage
WALL_BAND_M = (0.8, FLOOR_FARTHEST_M)  # walls are seen from farther away than things on the floor


def outline_goals(
    candidate: ObjectCandidate, score: float, context: PlanningContext, ledger: Ledger
) -> Iterator[Goal]:
    """The looks at what was not seen between a candidate and each room that is named, or, where the
    map does not show that, the named room that may hold it; but for what was looked at in vain.
    score: of the candidate."""
    description, cells = context.description, context.map_view.indices_of(candidate.surface)
    if description is None or not len(cells):
        return
    in_vain_xy = ledger.given_up_xy(GoalKind.OUTLINE)
    names = [*description.detail.inside, *description.detail.outside]
    held = place_of(description.places, context.map_view.grid, cells)
    if held is not None and not all(name in description.shown for name in names):
        names.append(held.name)
    for name in dict.fromkeys(names):
        target = _unseen_between(cells, name, description, context)
        offset_m = context.costmap.grid.centres(target)[:, None] - in_vain_xy
        target = target[(np.hypot(*offset_m.transpose(2, 0, 1)) > GIVEN_UP_RADIUS_M).all(axis=1)]
        if not len(target):
            continue
        seen_from = first_visible(viewpoints_around(SightTarget(target), context, WALL_BAND_M))
        if seen_from is not None:
            nearest = target[np.hypot(*(target - seen_from).T).argmin()]
            travel_m = context.cost_to_go.length_m((int(seen_from[0]), int(seen_from[1])))
            yield Goal(
                GoalKind.OUTLINE,
                context.xy_of(seen_from),
                context.xy_of(nearest),
                GoalUtility(score, travel_m),
                WALLS,
                context.map_view.world_cells(target),
            )


def _unseen_between(
    cells: I64, name: str, description: Description, context: PlanningContext
) -> I64:
    """Unseen cells (N, 2) at the edge of the free floor that may be a wall between the cells (K, 2)
    of a candidate and a room.

    They lie beside the cells of no part of a room on the way between both.
    """
    places, grid = description.places, context.map_view.grid
    place, _ = places.get(name) or (None, NO_ROOM)
    if place is None or place.corners_m:
        return cells[:0]
    named = np.argwhere(place_mask(places, name, grid, settled=True))
    if not len(named):  # not seen yet: somewhere around it
        named = np.clip(grid.cells(np.array([place.inside_m])), 0, np.array(grid.shape) - 1)
    parts = onto(grid, places.grid, places.parts, NO_ROOM)
    occupancy = context.map_view.occupancy
    cost = np.where(parts != NO_ROOM, 1.0, OPEN_COST)
    cost[occupancy == Occupancy.OCCUPIED] = WALL_COST
    ways = cost_to_go_from_any(cost, cells, cell_size_m=grid.cell_size_m)
    x, y = named[ways.cost_m[tuple(named.T)].argmin()].tolist()
    way = ways.path_to((x, y))
    opened: Bool = np.zeros(grid.shape, bool)
    opened[tuple(way[cost[tuple(way.T)] == OPEN_COST].T)] = True
    if not opened.any():
        return way[:0]
    speck = round(SPECK_M / grid.cell_size_m)
    known, free = occupancy != Occupancy.UNKNOWN, occupancy == Occupancy.FREE
    unseen = ndimage.binary_opening(
        np.pad(~known, speck, constant_values=True), np.ones((speck,) * 2)
    )
    edge = unseen[speck:-speck, speck:-speck] & ndimage.binary_dilation(free)
    near = ndimage.distance_transform_edt(~opened) * grid.cell_size_m <= DOOR_M
    found: I64 = np.argwhere(edge & near)
    return found
