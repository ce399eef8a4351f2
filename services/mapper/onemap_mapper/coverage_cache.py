"""The coverage of a map, computed for all queries of about the same moment.

It costs as much as a query, and changes slowly.
"""

from __future__ import annotations

from collections.abc import Callable

from cachetools import LRUCache

from onemap_mapper.coverage import FloorCoverage, floor_coverage
from onemap_mapper.map_version import MapVersion
from onemap_mapper.params import VerdictParams
from onemap_mapper.verdicts import area_mask

KEPT_S = 1.0  # in which a robot drives half a metre
MAX_AREAS = 32

Clock = Callable[[], float]


class CoverageCache:
    """The coverage of one map by area. Not thread-safe; ``clock_s``: seconds, monotonic."""

    def __init__(self, params: VerdictParams, clock_s: Clock) -> None:
        self._params, self._clock_s = params, clock_s
        self._kept: LRUCache[tuple[float, ...], tuple[float, FloorCoverage]] = LRUCache(MAX_AREAS)

    def coverage(
        self, version: MapVersion, area_m: tuple[float, ...], robot_xy_m: tuple[float, ...]
    ) -> FloorCoverage:
        """The coverage of an area, of this version or of one of the last second."""
        made_s, kept = self._kept.get(area_m, (0.0, None))
        if kept is not None and self._clock_s() - made_s < KEPT_S:
            return kept
        grid = version.grid
        found = floor_coverage(
            version.occupancy_grid(),
            version.layers(),
            grid,
            robot_xy_m=robot_xy_m,
            area=area_mask(grid, area_m),
            params=self._params,
        )
        self._kept[area_m] = (self._clock_s(), found)
        return found
