"""Places of the map that look most like an object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.world.components import components
from onemap_planner.world.map_view import MapView, WorldCells
from onemap_shared.geometry import Bool

MAX_PLACES = 3  # of one object, the most likely
REFUTED_SHARE = 0.5  # of a place's cells: it grows by a few whenever the map changes


@dataclass(frozen=True, slots=True)
class LikelyPlace:
    """xy: of its most similar cell, metres; probability: that the object is there; cells: all."""

    xy: tuple[float, float]
    probability: float
    cells: WorldCells


def similar_cells(map_view: MapView, threshold: float) -> Bool:
    """Mask (nx, ny) of the cells that look like the object, and more like no other name."""
    mask: Bool = np.nan_to_num(map_view.similarity, nan=0.0) >= threshold
    mask &= map_view.margin >= 0
    return mask


def likely_places(
    map_view: MapView, among: Bool, *, threshold: float, refuted: WorldCells
) -> tuple[LikelyPlace, ...]:
    """The most similar components of the mask (nx, ny), the best ``MAX_PLACES``.

    refuted: cells where the object was looked for in vain.
    """
    places = []
    for cells in components(similar_cells(map_view, threshold) & among):
        world = map_view.world_cells(cells)
        if len(world & refuted) >= REFUTED_SHARE * len(world):
            continue
        scores = map_view.similarity[cells[:, 0], cells[:, 1]]
        x, y = map_view.grid.centres(cells[int(np.argmax(scores))])
        places.append(LikelyPlace((float(x), float(y)), min(float(scores.max()), 1.0), world))
    return tuple(sorted(places, key=lambda place: (-place.probability, place.xy))[:MAX_PLACES])
