"""Moments of a search for the tests of films."""

from __future__ import annotations

import numpy as np

from onemap_gateway.present.render import Overlay
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    Detections,
    ObjectResult,
    Occupancy,
    SearchState,
    SearchStatus,
    SearchView,
)
from onemap_tools.demo.film.moment import FilmMoment

CELL_M = 0.1
FOUND_BED = ObjectResult(
    "bed", SearchState.FOUND, "seen", (4.5, 1.0, 0.4), 0.9, 8.0, 2.5, (0.0, 0.0), (4.0, 1.0)
)


def map_view(shape: tuple[int, int] = (60, 40), origin: tuple[int, int] = (0, 0)) -> SearchView:
    """Free floor without a similarity."""
    free = np.full(shape, Occupancy.FREE, np.uint8)
    nothing = np.zeros((0, 0), np.float32)
    grid = GridSpec(CELL_M, origin, free.shape)
    return SearchView("", 1, 1, 1, grid, free, np.zeros_like(free), nothing)


def search_status(
    state: SearchState = SearchState.EXPLORING,
    *results: ObjectResult,
    objects: tuple[str, ...] = ("bed", "sofa", "toilet"),
    reason: str = "driving",
) -> SearchStatus:
    return SearchStatus("s1", state, objects, len(results), reason, results, 1, 2, 3.0)


def moment(
    elapsed_s: float = 0.0,
    *,
    view: SearchView | None = None,
    overlay: Overlay | None = None,
    detections: Detections | None = None,
    status: SearchStatus | None = None,
    shade: int = 90,
) -> FilmMoment:
    """A moment with a camera image of one grey."""
    return FilmMoment(
        elapsed_s=elapsed_s,
        view=view or map_view(),
        overlay=overlay or Overlay(),
        camera=np.full((240, 320, 3), shade, np.uint8),
        detections=detections,
        status=status or search_status(),
    )
