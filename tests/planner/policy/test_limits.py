"""A search ends as failed when it has driven as far, or taken as long, as it may."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.progress import MAX_STUCK_COUNT, ProgressMonitor
from onemap_planner.policy.limits import is_trapped, limit_reached
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.search import state_machine as sm
from onemap_planner.search.state_machine import Approaching, Exploring, Finished, Phase
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import FailureCode, SearchState
from tests.planner.drawn_maps import PARAMS
from tests.planner.grid_world import in_two_rooms, start
from tests.planner.one_room import POSE, ROOM, SEARCH, candidate, planner_state
from tests.planner.search.test_state_machine import NOW

LIMIT_S = 600.0


def observed(now_s: float, odometer_m: float) -> Observation:
    return Observation(now_s, POSE, odometer_m, STOP, False, None, (), "")


def test_the_time_is_that_of_all_objects() -> None:
    search = replace(
        SEARCH, objects=("sofa", "bed"), phase=sm.Exploring(), budget=sm.Budget(0.0, 12.0)
    )
    search = sm.transition(search, sm.Ending(SearchState.NOT_FOUND, "no sofa"), NOW)  # after 9 s
    state = PlannerState(search)
    assert limit_reached(state, observed(11.9, 0.0), LIMIT_S) is None
    event = limit_reached(state, observed(12.0, 0.0), LIMIT_S)
    assert isinstance(event, sm.Ending)
    assert event.whole
    assert event.code is FailureCode.TIME_LIMIT


@pytest.mark.parametrize(("phase", "told"), [(Exploring(), True), (None, False)])
def test_what_was_seen_out_of_reach_is_told_at_the_limit(phase: Phase | None, told: bool) -> None:
    seen = candidate(2.5, 2.5)
    search = replace(SEARCH, phase=phase or Approaching(seen))
    state = replace(planner_state(seen), search=search)
    state.active_time_s = LIMIT_S + 100.0
    event = limit_reached(state, observed(0.0, 0.0), LIMIT_S)
    assert isinstance(event, sm.Ending)
    place = "at (2.5, 2.5), but no way to it was found"
    assert event.reason.startswith(f"not found within {LIMIT_S:.0f} s")
    assert event.reason.endswith(place) is told


def test_a_limit_ends_a_search_that_waits() -> None:
    search = replace(SEARCH, phase=sm.Exploring(), budget=sm.Budget(0, 12))
    waiting = replace(observed(12.0, 0.0), stale_reason="waiting for the map")
    assert step(PlannerState(search), replace(waiting, now_s=11.5), PARAMS).state.search.active
    ended = step(PlannerState(search), waiting, PARAMS).state.search
    assert ended.phase == sm.Finished(SearchState.FAILED)
    assert ended.results[-1].reason_code is FailureCode.TIME_LIMIT


def test_a_search_over_its_budget_has_failed_with_the_code() -> None:
    run = start(in_two_rooms(), "bed")
    run.state = replace(run.state, search=replace(run.state.search, budget=sm.Budget(1.5, 0.0)))
    search = run.until_over(60.0)
    assert search.phase == sm.Finished(SearchState.FAILED)
    (result,) = search.results
    assert result.reason_code is FailureCode.DISTANCE_LIMIT
    assert 1.5 <= result.path_length_m < 2.0


LIMIT = MAX_STUCK_COUNT


AHEAD = Velocity2d(0.3, 0.0)


def standing_at(now_s: float, command: Velocity2d) -> Observation:
    """What a robot sees that stays where it is while it is commanded."""
    return Observation(now_s, POSE, 0.0, command, False, ROOM, (), "")


def stuck_state(phase: Phase, stuck_count: int) -> PlannerState:
    """The state after this many collisions in one place, about six seconds apart."""
    state = replace(planner_state(candidate(2.5, 2.5)), search=replace(SEARCH, phase=phase))
    for number in range(8 * stuck_count + 5):
        standing = standing_at(0.7 * number, AHEAD)
        state = step(state, replace(standing, collided=number % 8 == 7), PARAMS).state
    return state


@pytest.mark.parametrize(
    ("command", "blocked", "met"),
    [
        (AHEAD, False, 1),
        (Velocity2d(0.0, 1.0), False, 0),
        (AHEAD, True, 0),  # the costmap has what is in the way
    ],
)
def test_what_a_robot_got_stuck_at_by_driving_is_remembered(
    command: Velocity2d, blocked: bool, met: int
) -> None:
    state = replace(planner_state(candidate(2.5, 2.5)), search=SEARCH)
    for number in range(8):
        standing = standing_at(0.7 * number, command)
        state = step(state, replace(standing, blocked=blocked), PARAMS).state
    assert state.progress is not None
    assert state.progress.stuck_count == 1
    assert len(state.obstacles_xy) == met


def monitored(stuck_count: int, phase: Phase) -> PlannerState:
    """A state whose robot got stuck this often at its pose."""
    progress = ProgressMonitor(POSE, 0.0, stuck_count=stuck_count, stuck_at=POSE)
    state = planner_state(candidate(2.5, 2.5))
    return replace(state, search=replace(SEARCH, phase=phase), progress=progress)


@pytest.mark.parametrize(
    ("count", "x_m", "trapped"), [(3, 1.5, True), (3, 2.5, False), (2, 1, False)]
)
def test_a_robot_is_trapped_near_where_it_got_stuck(count: int, x_m: float, trapped: bool) -> None:
    assert is_trapped(monitored(count, Exploring()), Pose2d(x_m, 1.0, 0.0)) == trapped


def test_collisions_in_one_place_end_the_search() -> None:
    end = stuck_state(Approaching(candidate(2.5, 2.5)), LIMIT + 3).search
    assert end.phase == Finished(SearchState.FAILED)
    assert end.reason == "the robot is stuck at (1.0, 1.0)"
