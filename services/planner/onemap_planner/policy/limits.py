"""Limits of time and distance: of one object by the settings, of a search by its request."""

from __future__ import annotations

from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import Observation, PlannerState
from onemap_planner.search.events import Event, SearchFailed, TargetFailed
from onemap_planner.search.state_machine import driven_m, elapsed_s
from onemap_shared.messages import FailureCode


def limit_reached(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> Event | None:
    """The event that ends the search, or the object, whose limit is reached; None without."""
    search, budget = state.search, state.search.budget
    driven = driven_m(search, observation.odometer_m)
    if budget.max_distance_m and driven >= budget.max_distance_m:
        return SearchFailed(
            f"drove {driven:.1f} m, and this search may drive {budget.max_distance_m:g} m",
            FailureCode.DISTANCE_LIMIT,
        )
    if budget.max_time_s and elapsed_s(search, observation.now_s) >= budget.max_time_s:
        return SearchFailed(
            f"not done within {budget.max_time_s:g} s, the limit for this search",
            FailureCode.TIME_LIMIT,
        )
    limit_s = params.explore.object_limit_s
    if state.active_time_s - search.target_start.since_active_time_s > limit_s:
        missed = "not found" if search.target else "not reached"
        return TargetFailed(
            f"{missed} within {limit_s:.0f} s, the limit for one object", FailureCode.TIME_LIMIT
        )
    return None
