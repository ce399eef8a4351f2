"""How much of the seen floor was explored, and where the map resembles the object most."""

from __future__ import annotations

import numpy as np

from onemap_planner.policy.context import PlanningContext
from onemap_shared.messages import Coverage, Occupancy


def coverage_of(context: PlanningContext) -> Coverage:
    """The coverage of the map as it is now."""
    map_view = context.map_view
    free = map_view.occupancy == Occupancy.FREE
    similarity = np.nan_to_num(map_view.similarity, nan=-1.0)
    best = np.unravel_index(int(np.argmax(similarity)), similarity.shape)
    score = float(similarity[best])
    x, y = map_view.grid.centres(np.array(best))
    return Coverage(
        explored_m2=float((free & map_view.explored).sum()) * map_view.cell_area_m2,
        free_m2=float(free.sum()) * map_view.cell_area_m2,
        unreachable_m2=context.unreachable_m2(),
        best_match_m=(float(x), float(y)) if score >= 0 else (),
        best_score=max(score, 0.0),
    )
