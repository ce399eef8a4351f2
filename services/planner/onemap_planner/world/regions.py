"""Regions of high similarity among the observed cells (O).

The paper takes E - C. What was seen only from afar is as good a reason to go there, once a
viewpoint of it can be reached; and what is in C may have been too far for the detector. Views
in which it had to find the object and did not lower the similarity (``world/undetected``), and
each region is looked at a few times only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt

from onemap_planner.world.components import components
from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F64, I64
from onemap_shared.params import Params


class SimilarRegionParams(Params):
    """What counts as a region worth a second look."""

    threshold: float = Field(
        default=0.3,
        ge=0,
        le=1,
        description="Similarity from which a cell may show the object.",
    )
    last_threshold: float = Field(
        default=0.1,
        ge=0,
        le=1,
        description="The same when everything has been searched: the best match of an object that "
        "was there, but badly seen, was 0.2 to 0.5 on the map of a weak encoder.",
    )
    last_looks: PositiveInt = Field(
        default=5, description="Places to look at again then, the best ones: a minute of driving."
    )
    min_area_m2: PositiveFloat = Field(
        default=0.01, description="Square metres: one map cell of 10 cm; a cup is not larger."
    )


@dataclass(frozen=True, slots=True)
class SimilarRegion:
    """A component: cells (K, 2) int64, centre (2,) metres and similarity of its best cell."""

    cells: I64
    peak_xy: F64
    score: float


def find_regions(map_view: MapView, params: SimilarRegionParams) -> tuple[SimilarRegion, ...]:
    """Components of similarity above the threshold in O, best first."""
    return _clusters(map_view, params.threshold, params)


def remaining_regions(map_view: MapView, params: SimilarRegionParams) -> tuple[SimilarRegion, ...]:
    """The best ``last_looks`` regions from ``last_threshold`` on.

    Before an object counts as not found, what looks a little like it is viewed from nearby.
    """
    return _clusters(map_view, params.last_threshold, params)[: params.last_looks]


def _clusters(
    map_view: MapView, threshold: float, params: SimilarRegionParams
) -> tuple[SimilarRegion, ...]:
    similar = np.nan_to_num(map_view.similarity, nan=0.0) >= threshold
    regions = []
    for cells in components(similar & map_view.observed):
        if len(cells) * map_view.cell_area_m2 < params.min_area_m2:
            continue
        scores = map_view.similarity[cells[:, 0], cells[:, 1]]
        peak = cells[int(np.argmax(scores))]
        regions.append(SimilarRegion(cells, map_view.grid.centres(peak), float(scores.max())))
    return tuple(sorted(regions, key=lambda region: -region.score))
