"""Finds for the map to keep, made of what a step confirmed."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from onemap_planner.search.events import Confirmed, Event
from onemap_planner.search.phases import Search
from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.grid import GridSpec
from onemap_shared.messages import ObjectFind


def finds_of(search: Search, events: Iterable[Event], grid: GridSpec) -> tuple[ObjectFind, ...]:
    """The finds among the events of a step; ``search`` is the search before them."""
    return tuple(
        object_find(search, event.candidate, grid)
        for event in events
        if isinstance(event, Confirmed)
    )


def object_find(search: Search, candidate: ObjectCandidate, grid: GridSpec) -> ObjectFind:
    """The candidate as a find, with the frame in which it was seen best."""
    view = candidate.best_view
    return ObjectFind(
        name=search.target,
        position_m=candidate.xyz,
        extent_m=extent_m(candidate, grid),
        score=min(candidate.similarity, 1.0),  # rounding
        stamp_ns=view.stamp_ns if view else 0,
        search_id=search.search_id,
        box_px=view.box_px if view else (),
        picture=view.picture if view else b"",
    )


def extent_m(candidate: ObjectCandidate, grid: GridSpec) -> tuple[float, float, float, float]:
    """x_min, y_min, x_max, y_max of the candidate's cells, metres in the map frame.

    ``grid``: any grid of the map, for the size of a cell.
    """
    cells = np.array(sorted(candidate.cells), np.int64).reshape(-1, 2)
    if len(cells) == 0:
        x, y, _ = candidate.xyz
        return x, y, x, y
    (ix, iy), (jx, jy) = cells.min(axis=0), cells.max(axis=0)
    covered = GridSpec(grid.cell_size_m, (int(ix), int(iy)), (int(jx - ix) + 1, int(jy - iy) + 1))
    return covered.bounds_m
