"""From how far a thing is looked at, by its height."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, radians, tan

import numpy as np

BEYOND_M = 0.1  # width of the bands beyond the farthest: a cell of the default size
LEAST_BAND_M = 0.2  # that its height leaves of a band: two cells of the default size


@dataclass(frozen=True, slots=True)
class Bands:
    """Distances from a target's surface to look at it from, tried in this order.

    distances_m: nearest and farthest of each; limit_m: farthest, where none of these can be
    reached; camera_m: height of the camera above the floor; down_deg, up_deg: how far below and
    above the horizontal its image reaches.
    """

    distances_m: tuple[tuple[float, float], ...]
    limit_m: float
    camera_m: float
    down_deg: float
    up_deg: float

    def at(self, height_m: float) -> tuple[tuple[float, float], ...]:
        """The bands for a target at this height, NaN if it is not known.

        Nearer than where the camera has that height in its image, it looks over the target, or
        under it: such places are left out, but for the farthest ones.
        """
        if not isfinite(height_m):
            return self.distances_m
        below_m = self.camera_m - height_m
        shown_m = abs(below_m) / tan(radians(self.down_deg if below_m > 0 else self.up_deg))
        return tuple(
            (max(nearest_m, min(shown_m, farthest_m - LEAST_BAND_M)), farthest_m)
            for nearest_m, farthest_m in self.distances_m
        )

    @property
    def beyond_m(self) -> tuple[tuple[float, float], ...]:
        """The bands from the farthest distance up to the limit, the nearest first."""
        _, farthest_m = self.distances_m[-1]
        edges_m = [*np.arange(farthest_m, self.limit_m, BEYOND_M).tolist(), self.limit_m]
        return tuple(pairwise(edges_m))
