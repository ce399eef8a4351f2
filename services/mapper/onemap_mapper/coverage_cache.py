"""The coverage of a map, computed for all queries of about the same moment.

It costs as much as a query, and changes slowly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cachetools import LRUCache

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.coverage import FloorCoverage, floor_coverage
from onemap_mapper.params import VerdictParams
from onemap_mapper.verdicts import area_mask
from onemap_shared.geometry import U8
from onemap_shared.grid import GridSpec

KEPT_S = 1.0  # in which a robot drives half a metre
MAX_AREAS = 32

Clock = Callable[[], float]


@dataclass(frozen=True, slots=True)
class FloorLayers:
    """A copy of occupancy and layers (nx, ny) on ``grid``; empty if the coverage is known."""

    grid: GridSpec
    occupancy: U8
    layers: U8


class CoverageCache:
    """The coverage of one map by area. Not thread-safe; ``clock_s``: seconds, monotonic."""

    def __init__(self, params: VerdictParams, clock_s: Clock) -> None:
        self._params, self._clock_s = params, clock_s
        self._kept: LRUCache[tuple[float, ...], tuple[float, FloorCoverage]] = LRUCache(MAX_AREAS)

    def layers(self, belief: BeliefMap, area_m: tuple[float, ...]) -> FloorLayers | None:
        """What ``coverage`` needs of a map, with its lock held; None if nothing."""
        made_s, _ = self._kept.get(area_m, (-KEPT_S, None))
        if self._clock_s() - made_s < KEPT_S:
            return None
        return FloorLayers(belief.grid, belief.occupancy_grid(), belief.layers())

    def coverage(
        self, layers: FloorLayers | None, area_m: tuple[float, ...], robot_xy_m: tuple[float, ...]
    ) -> FloorCoverage:
        """The coverage of an area, without the lock: of ``layers``, or the one that is kept."""
        if layers is None:
            return self._kept[area_m][1]
        found = floor_coverage(
            layers.occupancy,
            layers.layers,
            layers.grid,
            robot_xy_m=robot_xy_m,
            area=area_mask(layers.grid, area_m),
            params=self._params,
        )
        self._kept[area_m] = (self._clock_s(), found)
        return found
