"""Messages of the planner and the mapper for tests."""

from __future__ import annotations

import numpy as np

from onemap_shared import messages as m
from onemap_shared.grid import GridSpec

FREE, SEEN = m.Occupancy.FREE, m.Layer.OBSERVED
KEPT = m.KeptObject("id1", "sofa", (1.0, 2.0, 0.4), (0.5, 1.5, 1.7, 2.5), 0.75, 1, "s1", 1, 2)


def status(search_id: str, state: m.SearchState = m.SearchState.EXPLORING) -> m.SearchStatus:
    return m.SearchStatus(search_id, state, ("sofa",), 0, "it looks", (), 1, 2, 0.0)


def path_to(
    x_m: float, y_m: float, motion: str = "drive", look: tuple[float, float] | None = None
) -> m.PlannedPath:
    """A path from the origin."""
    points = np.array([[0.0, 0.0], [x_m, y_m]], np.float32)
    frontiers, regions = points + 1, points - 1
    scores = np.array([0.2, 0.9], np.float32)
    goal, kind = points[-1:], "frontier"
    return m.PlannedPath(
        1, kind, "near", points, goal, frontiers, scores, regions, scores, motion, look or ()
    )


def view() -> m.SearchView:
    """3 x 2 cells: unknown, free, free and explored; occupied, seen, seen."""
    occupancy = np.array([[0, FREE], [FREE, m.Occupancy.OCCUPIED], [FREE, FREE]], np.uint8)
    layers = np.array([[0, SEEN], [SEEN | m.Layer.EXPLORED, SEEN], [SEEN, SEEN]], np.uint8)
    similarity = np.array([[0.9, 0.25], [1.0, 0.0], [np.nan, 0.5]], np.float32)
    return m.SearchView(
        "sofa", 3, 4, 5, GridSpec(0.5, (-2, 4), (3, 2)), occupancy, layers, similarity
    )
