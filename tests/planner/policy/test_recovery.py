"""A robot that keeps getting stuck gives up the goal, then the search."""

from dataclasses import replace

import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.progress import MAX_STUCK_COUNT, ProgressMonitor
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.memory import ActiveGoal, PlannerState, TargetMemory
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.step import handle_stuck, is_trapped, step
from onemap_planner.search.state_machine import (
    Approaching,
    Exploring,
    Finished,
    Phase,
)
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchState
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import POSE, ROOM, SEARCH, candidate, planner_state

LIMIT = MAX_STUCK_COUNT


def stuck_state(phase: Phase, stuck_count: int) -> PlannerState:
    """The state after this many collisions in one place, about six seconds apart."""
    state = replace(planner_state(candidate(2.5, 2.5)), search=replace(SEARCH, phase=phase))
    for number in range(8 * stuck_count + 5):
        observation = Observation(
            now_s=0.7 * number,
            pose=POSE,
            odometer_m=0.0,
            command=Velocity2d(0.3, 0.0),
            collided=number % 8 == 7,
            view=ROOM,
            detections=(),
            stale_reason="",
        )
        state = step(state, observation, PARAMS).state
    return state


def monitored(stuck_count: int, phase: Phase) -> PlannerState:
    """A state whose robot got stuck this often at its pose."""
    progress = ProgressMonitor(POSE, 0.0, stuck_count=stuck_count, stuck_at=POSE)
    state = planner_state(candidate(2.5, 2.5))
    return replace(state, search=replace(SEARCH, phase=phase), progress=progress)


def test_at_the_limit_the_active_goal_is_blacklisted() -> None:
    goal = Goal(GoalKind.FRONTIER, (1.0, 2.0), (3.0, 2.0), GoalUtility(0.5, 0.0, 1.0, 1.0), "")
    state = monitored(LIMIT, Exploring())
    state = replace(
        state, memory=TargetMemory(active_goal=ActiveGoal(goal, 0.0, 9.0, goal.look_xy))
    )
    after, events = state, handle_stuck(state)
    assert events == ()
    assert after.visited_frontiers == after.unreached_frontiers == (goal.look_xy,)
    assert after.memory.active_goal is None


@pytest.mark.parametrize(
    ("count", "x_m", "trapped"), [(3, 1.5, True), (3, 2.5, False), (2, 1, False)]
)
def test_a_robot_is_trapped_near_where_it_got_stuck(count: int, x_m: float, trapped: bool) -> None:
    assert is_trapped(monitored(count, Exploring()), Pose2d(x_m, 1.0, 0.0)) == trapped


def test_collisions_in_one_place_end_the_search() -> None:
    end = stuck_state(Approaching(candidate(2.5, 2.5)), LIMIT + 3).search
    assert end.phase == Finished(SearchState.FAILED)
    assert end.reason == "the robot is stuck at (1.0, 1.0)"
