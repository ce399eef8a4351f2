"""Blacklisted goals are offered again when a door was opened."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.reopening import without_changed
from onemap_planner.policy.state import PlannerState, blacklist
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import PARAMS, drawn_map
from tests.planner.one_room import planner_state

ROOM = drawn_map(*["." * 40] * 60)


def given_up() -> PlannerState:
    state = planner_state()
    for kind, x in ((GoalKind.FRONTIER, 1.0), (GoalKind.REGION, 1.2), (GoalKind.FRONTIER, 5.0)):
        goal = Goal(kind, (x, 1.0), (x, 1.0), GoalUtility(0.5, 0.0, 1.0, 1.0), "")
        state = blacklist(state, goal)
    return state


def test_goals_near_a_change_are_offered_again() -> None:
    state = without_changed(given_up(), ROOM, PARAMS.dead_end)
    assert len(state.dead_ends) == 3
    assert without_changed(state, ROOM, PARAMS.dead_end) == state
    occupancy = ROOM.occupancy.copy()
    occupancy[8:14, 8:16] = Occupancy.OCCUPIED
    changed = replace(ROOM, occupancy=occupancy)
    state = without_changed(state, changed, PARAMS.dead_end)
    assert state.blacklisted_frontiers == ((5.0, 1.0),)
    assert state.target_state.blacklisted == ()


def test_without_blacklisted_goals_nothing_is_remembered() -> None:
    state = planner_state()
    assert without_changed(state, ROOM, PARAMS.dead_end) is state
    assert np.all(ROOM.occupancy == Occupancy.FREE)
