"""The methods that the benchmark compares: each a set of switches and planner parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from onemap_mapper.query.replies import NO_GRID
from onemap_planner.config import PlannerConfig
from onemap_planner.world.candidates import Consensus
from onemap_shared.messages import SearchView
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.frontier_exploration import (
    NEAREST_FRONTIER,
    VLFM,
)
from onemap_tools.bench.navigation.value_map import ConfidenceValueMap, scored_view
from onemap_tools.bench.search_method import SearchMethod

# Without consensus: any cell of a detection counts.
ANY_DETECTION = Consensus(percentile=0.0, floor=0.0)
NO_CONSENSUS = frozenset({Method.ONEMAP_NO_CONSENSUS, Method.VLFM, Method.NEAREST_FRONTIER})


def search_method(method: Method, cell_size_m: float) -> SearchMethod:
    """The switches of a method that searches on a map of these cells."""
    consensus = ANY_DETECTION if method in NO_CONSENSUS else Consensus()
    return replace(_switches(method, cell_size_m), consensus=consensus)


def _switches(method: Method, cell_size_m: float) -> SearchMethod:
    match method:
        case Method.ONEMAP_RESET:
            return SearchMethod(forgets=True)
        case Method.ONEMAP_NO_CONSENSUS:
            return SearchMethod(view=without_rivals)
        case Method.NEAREST_FRONTIER:
            return SearchMethod(exploration=NEAREST_FRONTIER, view=without_similarity)
        case Method.VLFM:
            values = ConfidenceValueMap(cell_size_m)
            return SearchMethod(exploration=VLFM, value_map=values, forgets=True)
        case _:
            return SearchMethod()


def planner_config(config: PlannerConfig, limit_s: float) -> PlannerConfig:
    """The planner's parameters for so many seconds per object."""
    changed = merged(config.model_dump(), {"explore": {"object_limit_s": limit_s}})
    return PlannerConfig.model_validate(changed)


def without_rivals(view: SearchView) -> SearchView:
    """The view without competing names."""
    return replace(view, rival=NO_GRID)


def without_similarity(view: SearchView) -> SearchView:
    """The view with similarity 0 in all observed cells and nothing else that words decide."""
    return scored_view(view, view.similarity * np.float32(0))


def merged(document: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """The document with the changes, sections within sections."""
    return {
        **document,
        **{
            name: merged(document[name], value) if isinstance(value, dict) else value
            for name, value in changes.items()
        },
    }
