"""A search ends as failed when it has driven as far, or taken as long, as it may."""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.motion.motions import STOP
from onemap_planner.policy.memory import PlannerState
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.step import limit_reached
from onemap_planner.search import state_machine as sm
from onemap_shared.messages import FailureCode, SearchState
from tests.planner.grid_world import in_two_rooms, start
from tests.planner.one_room import POSE, SEARCH
from tests.planner.search.test_state_machine import NOW

LIMIT_S = 600.0


def observed(now_s: float, odometer_m: float) -> Observation:
    return Observation(now_s, POSE, odometer_m, STOP, False, None, (), "")


def with_budget(distance_m: float = 0.0, time_s: float = 0.0) -> PlannerState:
    return PlannerState(replace(SEARCH, budget=sm.Budget(distance_m, time_s)))


def test_without_a_budget_only_the_time_for_an_object_counts() -> None:
    state = with_budget()
    assert limit_reached(state, observed(1e4, 1e4), LIMIT_S) is None
    event = limit_reached(replace(state, active_time_s=LIMIT_S + 1), observed(0.0, 0.0), LIMIT_S)
    assert isinstance(event, sm.Ending)
    assert not event.whole
    assert event.code is FailureCode.TIME_LIMIT


def test_the_distance_is_that_of_the_search() -> None:
    assert limit_reached(with_budget(5.0), observed(9.0, 4.9), LIMIT_S) is None
    event = limit_reached(with_budget(5.0), observed(9.0, 5.0), LIMIT_S)
    assert event == sm.Ending(
        SearchState.FAILED,
        "drove 5.0 m, and this search may drive 5 m",
        FailureCode.DISTANCE_LIMIT,
        whole=True,
    )


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


def test_a_search_over_its_budget_has_failed_with_the_code() -> None:
    run = start(in_two_rooms(), "bed")
    run.state = replace(run.state, search=replace(run.state.search, budget=sm.Budget(1.5, 0.0)))
    search = run.until_over(60.0)
    assert search.phase == sm.Finished(SearchState.FAILED)
    (result,) = search.results
    assert result.reason_code is FailureCode.DISTANCE_LIMIT
    assert 1.5 <= result.path_length_m < 2.0
