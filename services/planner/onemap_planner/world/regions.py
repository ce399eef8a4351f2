"""What the map takes for the object: regions to look at, and what the detector did not find."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_planner.world.map_view import MapView, components
from onemap_shared.geometry import F32, F64, I64

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


# Probability that a detector misses an object in such a view: more than in a single frame
# (``candidates.DETECTED``), since misses of one object come together.
MISSED = 0.5


@dataclass(frozen=True, slots=True)
class UndetectedViews:
    """How many views of similar cells had no detection.

    counts: by world cells; seen_from: x, y (metres) and yaw of the last view that counted.
    """

    counts: dict[tuple[int, int], int] = field(default_factory=dict)
    seen_from: tuple[float, float, float] | None = None


def discounted(map_view: MapView, views: UndetectedViews) -> MapView:
    """The map view with the promise as its similarity, lower by ``MISSED`` for each view without a
    detection."""
    similarity: F32 = map_view.promise.copy()
    if views.counts:
        cells = np.array(list(views.counts), np.int64) - np.asarray(map_view.grid.origin_cell)
        inside = map_view.grid.contains(cells)
        x, y = cells[inside].T
        left = MISSED ** np.array(list(views.counts.values()))[inside]
        similarity[x, y] *= left.astype(np.float32)
    return replace(map_view, similarity=similarity)
