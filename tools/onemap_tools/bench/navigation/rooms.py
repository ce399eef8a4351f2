"""How well the rooms of a map fit the floor plan of its apartment."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from onemap_mapper.places.rooms import rooms_of
from onemap_shared.messages import NO_ROOM, Occupancy, SearchView
from onemap_simulator.scene.scene import Scene

MIN_SEEN_M2 = 1.0  # of a room's floor: with less it was not visited


def room_ious(view: SearchView, scene: Scene) -> Iterator[float]:
    """Of each true room that was seen: IoU of its free cells with those of the best room found,
    within all true rooms."""
    found, free = rooms_of(view), view.occupancy == Occupancy.FREE
    grid = found.grid
    centres = grid.centres(np.argwhere(np.ones(grid.shape, bool))).reshape(*grid.shape, 2)
    bounds = [np.reshape(room.bounds_m, (2, 2)) for room in scene.rooms]
    masks = [free & ((centres > low) & (centres < high)).all(axis=2) for low, high in bounds]
    inside = np.logical_or.reduce(masks)
    for mask in masks:
        if mask.sum() * grid.cell_size_m**2 >= MIN_SEEN_M2:
            ids = {*found.ids[mask].tolist()} - {NO_ROOM}
            parts = [(found.ids == room) & inside for room in ids]
            yield max(((mask & part).sum() / (mask | part).sum() for part in parts), default=0.0)
