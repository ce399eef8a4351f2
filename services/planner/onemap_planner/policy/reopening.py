"""Offers blacklisted goals again once the map around them has changed."""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.policy.dead_ends import updated_dead_ends
from onemap_planner.policy.state import PlannerState
from onemap_planner.world.map_view import MapView


def without_changed(state: PlannerState, map_view: MapView) -> PlannerState:
    """The state without blacklisted goals around which obstacles have come or gone since."""
    blacklisted = state.target_state.blacklisted
    given_up_xy = (*state.blacklisted_frontiers, *(goal.look_xy for goal in blacklisted))
    if not given_up_xy:
        return state
    dead_ends = updated_dead_ends(state.dead_ends, given_up_xy, map_view)
    state = replace(state, dead_ends=dead_ends)
    again = {dead_end.xy for dead_end in dead_ends if dead_end.open}
    if again.isdisjoint(given_up_xy):
        return state
    left = tuple(goal for goal in blacklisted if goal.look_xy not in again)
    frontiers = tuple(xy for xy in state.blacklisted_frontiers if xy not in again)
    target_state = replace(state.target_state, blacklisted=left)
    return replace(state, target_state=target_state, blacklisted_frontiers=frontiers)
