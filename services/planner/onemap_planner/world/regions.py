"""Regions: known well, similar to the object, and not yet searched for it (E - C)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from onemap_planner.world.costmap import EIGHT
from onemap_planner.world.map_view import Belief
from onemap_shared.geometry import F64, I64, Bool


@dataclass(frozen=True, slots=True)
class RegionRules:
    """What counts as a region; see ``PlannerConfig`` for the values."""

    threshold: float
    last_threshold: float
    last_looks: int
    min_area_m2: float


@dataclass(frozen=True, slots=True)
class Region:
    """A cluster: cells (K, 2) int64, the most similar cell's centre (2,) metres and score."""

    cells: I64
    peak_xy: F64
    score: float


def find_regions(belief: Belief, rules: RegionRules) -> tuple[Region, ...]:
    """Clusters of similarity above the threshold in E - C, best first."""
    return _clusters(belief, belief.explored & ~belief.searched, rules.threshold, rules)


def remaining_regions(belief: Belief, rules: RegionRules) -> tuple[Region, ...]:
    """The best few anywhere on the map, from a lower threshold on.

    In the first search E and C are one, and C only says that the camera looked, perhaps from
    too far for the detector; before an object is given up, these places deserve a closer look.
    """
    return _clusters(belief, belief.observed, rules.last_threshold, rules)[: rules.last_looks]


def _clusters(
    belief: Belief, among: Bool, threshold: float, rules: RegionRules
) -> tuple[Region, ...]:
    similar = np.nan_to_num(belief.similarity, nan=0.0) >= threshold
    parts, count = ndimage.label(similar & among, EIGHT)
    regions = []
    for index, box in enumerate(ndimage.find_objects(parts, count), start=1):
        cells = np.argwhere(parts[box] == index) + [side.start for side in box]
        if len(cells) * belief.cell_area_m2 < rules.min_area_m2:
            continue
        scores = belief.similarity[cells[:, 0], cells[:, 1]]
        peak = cells[int(np.argmax(scores))]
        regions.append(Region(cells, belief.grid.centres(peak), float(scores.max())))
    return tuple(sorted(regions, key=lambda region: -region.score))
