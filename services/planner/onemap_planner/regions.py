"""Regions: known well, similar to the object, and not yet searched for it (E - C)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from onemap_planner.belief import Belief
from onemap_planner.terrain import EIGHT
from onemap_shared.geometry import F64, I64


@dataclass(frozen=True, slots=True)
class RegionRules:
    """What counts as a region; see ``PlannerConfig`` for the values."""

    threshold: float
    min_area_m2: float


@dataclass(frozen=True, slots=True)
class Region:
    """A cluster: cells (K, 2) int64, the most similar cell's centre (2,) metres and score."""

    cells: I64
    peak_xy: F64
    score: float


def find_regions(belief: Belief, rules: RegionRules) -> tuple[Region, ...]:
    """8-connected clusters of similarity above the threshold in E - C, best first."""
    similar = np.nan_to_num(belief.similarity, nan=0.0) >= rules.threshold
    parts, count = ndimage.label(similar & belief.explored & ~belief.searched, EIGHT)
    regions = []
    for index, box in enumerate(ndimage.find_objects(parts, count), start=1):
        cells = np.argwhere(parts[box] == index) + [side.start for side in box]
        if len(cells) * belief.cell_area_m2 < rules.min_area_m2:
            continue
        scores = belief.similarity[cells[:, 0], cells[:, 1]]
        peak = cells[int(np.argmax(scores))]
        regions.append(Region(cells, belief.grid.centres(peak), float(scores.max())))
    return tuple(sorted(regions, key=lambda region: -region.score))
