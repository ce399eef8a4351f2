"""What closes a way over floor that was seen is looked at; what hides its floor is a wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import GoalKind
from onemap_planner.policy.memory import MAX_LOOKS, PlannerState
from onemap_planner.policy.ways import PLACE_FARTHEST_M, looks_at_closed_ways
from onemap_planner.search.state_machine import Ending
from tests.planner.drawn_maps import PARAMS, drawn_map, search_view_of
from tests.planner.one_room import SEARCH, context_of, explored, without

NOWHERE = np.zeros((0, 2))


def two_rooms(door: str, far: str = ".") -> PlanningContext:
    """Two rooms of 4 x 4 m, the robot in the first; the door of 1 m shows this character."""
    wall = "#" * 9
    rows = [
        wall,
        *["#" + "." * 7 + "#"] * 7,
        "#" + "##" + door * 2 + "#" * 4,
        *["#" + far * 7 + "#"] * 7,
        wall,
    ]
    return context_of(search_view_of(drawn_map(*rows, scale=5)), Pose2d(1.5, 2.0, 0.0))


def test_somebody_in_the_only_door_is_looked_at() -> None:
    here = two_rooms("g")
    (goal,) = looks_at_closed_ways(here, NOWHERE)
    assert goal.kind is GoalKind.LOOK_AT
    assert goal.look_xy == pytest.approx((4.25, 2.0), abs=0.3)
    away_m = np.hypot(*np.subtract(goal.viewpoint_xy, goal.look_xy))
    assert PARAMS.costmap.escape_radius_m <= away_m <= PLACE_FARTHEST_M + 0.5
    cell = here.costmap.grid.cells(np.array(goal.viewpoint_xy))
    assert np.isfinite(here.cost_to_go.cost_m[tuple(cell)])


def test_a_search_looks_there_before_it_gives_up() -> None:
    here = two_rooms("g")
    state, looks = PlannerState(SEARCH), []
    for step in range(200):
        state, _, event, _ = explored(state, here)
        goal = state.memory.active_goal
        if isinstance(event, Ending):
            break
        if goal is not None and goal.goal.kind is GoalKind.LOOK_AT:
            looks.append(goal.goal.viewpoint_xy)
            state = without(state, goal.goal)  # seen, and still closed
        state = replace(state, active_time_s=float(step))
    assert isinstance(event, Ending)
    assert len(set(looks)) == len(looks) == MAX_LOOKS
