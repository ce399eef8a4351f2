"""What the map takes for the object: regions to look at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.world.map_view import MapView, components
from onemap_shared.geometry import F64, I64

SIMILAR = 0.3  # similarity from which a cell may show the object
MIN_REGION_M2 = 0.01  # square metres: one map cell of 10 cm; a cup is not larger


@dataclass(frozen=True, slots=True)
class SimilarRegion:
    """A component: cells (K, 2) int64, centre (2,) metres and similarity of its best cell."""

    cells: I64
    peak_xy: F64
    score: float


def find_regions(map_view: MapView) -> tuple[SimilarRegion, ...]:
    """Components of similarity above the threshold in O, best first."""
    similar = np.nan_to_num(map_view.similarity, nan=0.0) >= SIMILAR
    regions = []
    for cells in components(similar & map_view.observed):
        if len(cells) * map_view.cell_area_m2 < MIN_REGION_M2:
            continue
        scores = map_view.similarity[cells[:, 0], cells[:, 1]]
        peak = cells[int(np.argmax(scores))]
        regions.append(SimilarRegion(cells, map_view.grid.centres(peak), float(scores.max())))
    return tuple(sorted(regions, key=lambda region: -region.score))
