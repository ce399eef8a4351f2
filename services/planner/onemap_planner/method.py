"""How objects are searched for: in OneMap's way, unless the planner is given another."""
# Talks: calls the mapper, on the planning thread, when the search for an object begins.

from __future__ import annotations

from onemap_planner.policy.outcome import Observation, Outcome
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.search.state_machine import Search
from onemap_planner.world.map_view import PlanningView
from onemap_shared import keys
from onemap_shared.messages import SearchReset
from onemap_shared.transport import Bus

RESET_TIMEOUT_S = 1.0  # it takes some milliseconds


class PlanningMethod:
    """OneMap's; a subclass overrides what it does otherwise. The planning thread calls it."""

    def begin(self, bus: Bus, search: Search) -> None:
        """Before the first view for an object: nothing was searched yet. Raises ``CallError``."""
        bus.call(keys.MAP_SEARCH_RESET, SearchReset(search.search_id), RESET_TIMEOUT_S)

    def seen(self, view: PlanningView) -> PlanningView:
        """What it plans on, of the map's view for the present object."""
        return view

    def step(self, state: PlannerState, observation: Observation, params: PlannerParams) -> Outcome:
        """The state after an observation, and what to do."""
        return step(state, observation, params)


ONEMAP = PlanningMethod()
