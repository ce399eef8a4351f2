"""Exploration by frontiers: which is chosen, when it is kept, and when none is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Drive, Rest
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.memory import LINGER_S, SETTLE_S, PlannerState
from onemap_planner.search.phases import Exhausted
from onemap_tools.bench.navigation.frontier_exploration import (
    NEAREST_FRONTIER,
    FrontierExploration,
    frontier_value,
)
from tests.planner.drawn_maps import NO_POINTS, PARAMS, drawn_map, search_view_of
from tests.planner.one_room import POSE, SEARCH, candidate, context, explored, planner_state


def seen(*rows: str) -> PlanningContext:
    view = search_view_of(drawn_map(*rows, scale=5))
    return build_context(POSE, view, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap)


def utility(travel_m: float) -> GoalUtility:
    return GoalUtility.of(0.0, travel_m)


BOTH_ENDS = seen(*["   .........      "] * 10)


def test_the_nearest_frontier_is_chosen_and_kept() -> None:
    state, motion, event, candidates = explored(PlannerState(SEARCH), BOTH_ENDS, NEAREST_FRONTIER)
    assert isinstance(motion, Drive)
    assert event is None
    assert len(candidates.frontiers) >= 2
    goal = state.memory.active_goal
    assert goal is not None
    again, *_ = explored(replace(state, active_time_s=1.0), BOTH_ENDS, NEAREST_FRONTIER)
    assert again.memory.active_goal == goal
    farthest = FrontierExploration(lambda goal, _: goal.utility.travel_m, margin=0.0)
    other, *_ = explored(state, BOTH_ENDS, farthest)
    assert other.memory.active_goal is not None
    away_m = other.memory.active_goal.goal.utility.travel_m
    assert away_m > goal.goal.utility.travel_m


def test_a_goal_that_takes_too_long_or_was_visited_is_blacklisted() -> None:
    state, *_ = explored(PlannerState(SEARCH), BOTH_ENDS, NEAREST_FRONTIER)
    goal = state.memory.active_goal
    assert goal is not None
    late = replace(state, active_time_s=goal.budget_s + 0.1)
    after, *_ = explored(late, BOTH_ENDS, NEAREST_FRONTIER)
    assert goal.goal.look_xy in after.visited_frontiers
    there = replace(state.memory, active_goal=replace(goal, arrived_s=0.0))
    lingered = replace(state, memory=there, active_time_s=LINGER_S)
    after, *_ = explored(lingered, BOTH_ENDS, NEAREST_FRONTIER)
    assert goal.goal.look_xy in after.visited_frontiers


def test_without_a_frontier_everything_is_tried_once_more_before_it_ends() -> None:
    settle_s = SETTLE_S
    state = planner_state()
    rejected = replace(state.memory, rejected=(candidate(2.5, 2.5),))
    state = replace(state, memory=rejected, visited_frontiers=((1.0, 1.0),))
    state, motion, event, _ = explored(state, context(), NEAREST_FRONTIER)
    assert (motion, event) == (Rest(), None)
    state, *_ = explored(replace(state, active_time_s=settle_s + 0.1), context(), NEAREST_FRONTIER)
    assert state.memory.reconsidered
    assert state.memory.rejected == ()
    assert state.visited_frontiers == ()
    state, *_ = explored(state, context(), NEAREST_FRONTIER)
    late = replace(state, active_time_s=2 * settle_s + 0.2)
    _, _, event, _ = explored(late, context(), NEAREST_FRONTIER)
    assert isinstance(event, Exhausted)
    assert "no frontier is left on" in event.reason


def test_the_value_of_a_frontier_is_the_highest_near_it() -> None:
    place = BOTH_ENDS.map_view.grid.centres(np.array([12, 12]))
    similarity = np.full(BOTH_ENDS.map_view.grid.shape, np.nan, np.float32)
    similarity[14, 12], similarity[25, 12] = 0.6, 0.9
    context = replace(BOTH_ENDS, map_view=replace(BOTH_ENDS.map_view, similarity=similarity))
    xy = (float(place[0]), float(place[1]))
    goal = Goal(GoalKind.FRONTIER, xy, xy, utility(1.0), "")
    assert frontier_value(goal, context) == np.float32(0.6)
    away = replace(goal, look_xy=(xy[0] - 5.0, xy[1]))
    assert frontier_value(away, context) == 0.0
