"""Cells that the map takes for the object, but on which the detector found nothing.

Consensus works in both directions: what the map takes for the object and the detector does not
find, from where it would, is less likely the object. The robot need not drive up to it then.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F32

MISSED = 0.5  # probability that a detector misses an object in such a view: it misses 0.3 of the
# single frames (``AcceptanceParams.detected``), and misses of one object come together


@dataclass(frozen=True, slots=True)
class UndetectedViews:
    """How many views of similar cells had no detection.

    counts: by world cells; seen_from: x, y (metres) and yaw of the last view that counted.
    """

    counts: dict[tuple[int, int], int] = field(default_factory=dict)
    seen_from: tuple[float, float, float] | None = None


def discounted(map_view: MapView, views: UndetectedViews) -> MapView:
    """The map view whose similarity is lower by ``MISSED`` for each view without a detection."""
    if not views.counts:
        return map_view
    cells = np.array(list(views.counts), np.int64) - np.asarray(map_view.grid.origin_cell)
    inside = map_view.grid.contains(cells)
    x, y = cells[inside].T
    left = MISSED ** np.array(list(views.counts.values()))[inside]
    similarity: F32 = map_view.similarity.copy()
    similarity[x, y] *= left.astype(np.float32)
    return replace(map_view, similarity=similarity)
