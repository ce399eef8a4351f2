"""One search at a time; what happened to older ones can be asked."""

from dataclasses import replace

import pytest

from onemap_planner.policy.memory import FoundObject, PlannerState
from onemap_planner.search.phases import Destination, EventStamp, Exhausted, Exploring
from onemap_planner.search.state_machine import new_search, status, transition
from onemap_planner.searches import MAX_PAST_SEARCHES, SearchRegistry
from onemap_shared.messages import SearchKind
from onemap_shared.transport import RequestRejected

THEN = EventStamp(5.0, 4.0, (0.5, -1.0), 10.0)


NOW = EventStamp(9.0, 8.0, (1.0, 1.0), 14.0)


def test_one_search_at_a_time() -> None:
    registry = SearchRegistry()
    first = registry.start(new_search("a", ("cup",), THEN, 1))
    with pytest.raises(RequestRejected, match="search a for 'cup' is still active") as refused:
        registry.start(new_search("b", ("bed",), THEN, 2))
    assert refused.value.code == "conflict"
    registry.cancel("a", NOW)
    assert not registry.find("a").active
    assert (
        registry.start(new_search("b", ("bed",), THEN, 2)).search_id == registry.find("").search_id
    )
    assert registry.find("a").search_id == first.search_id
    assert registry.cancel("a", NOW) == registry.find("a")  # over already


def test_unknown_searches_are_refused() -> None:
    registry = SearchRegistry()
    for search_id in ("", "nonsense"):
        with pytest.raises(RequestRejected) as refused:
            registry.find(search_id)
        assert refused.value.code == "unknown_search"
        with pytest.raises(RequestRejected):
            registry.cancel(search_id, NOW)


def test_a_search_cancelled_during_a_step_stays_cancelled() -> None:
    registry = SearchRegistry()
    registry.start(new_search("a", ("cup",), THEN, 1))
    taken = registry.state
    assert taken is not None
    registry.cancel("", NOW)
    assert not registry.compare_and_swap(taken, replace(taken, active_time_s=1.0))
    assert registry.state is not None
    assert not registry.state.search.active


def test_the_end_of_a_search_is_recorded_once() -> None:
    times = iter([100, 200])
    registry = SearchRegistry(clock_ns=lambda: next(times))
    registry.start(new_search("a", ("cup",), THEN, 1))
    taken = registry.state
    assert taken is not None
    exploring = replace(taken.search, phase=Exploring())
    given_up = transition(exploring, Exhausted("nothing left"), NOW)
    assert registry.compare_and_swap(taken, replace(taken, search=given_up))
    registry.start(new_search("b", ("bed",), THEN, 150))
    registry.cancel("b", NOW)
    for search_id, ended_ns in (("a", 100), ("b", 200), ("b", 200)):
        message = status(registry.cancel(search_id, NOW), odometer_m=0.0, now_ns=999)
        assert message.updated_ns == ended_ns


def test_only_the_last_searches_are_kept() -> None:
    registry = SearchRegistry()
    for number in range(MAX_PAST_SEARCHES + 2):
        registry.start(new_search(str(number), ("cup",), THEN, number))
        registry.cancel("", NOW)
    with pytest.raises(RequestRejected):
        registry.find("0")
    assert registry.find("5").search_id == "5"
    listed = [int(search.search_id) for search in registry.all()]
    assert listed == list(range(MAX_PAST_SEARCHES + 1, 0, -1))


def test_a_restored_search_is_the_newest() -> None:
    search = new_search("a", ("cup",), THEN, 1)
    registry = SearchRegistry(search)
    assert registry.state == PlannerState(search)
    assert registry.all() == [search]


def test_before_the_first_search_none_is_listed() -> None:
    assert SearchRegistry().all() == []


def test_found_objects_are_kept_over_a_drive_to_a_place() -> None:
    registry = SearchRegistry()
    registry.start(new_search("a", ("cup",), THEN, 1))
    taken = registry.state
    assert taken is not None
    found = (FoundObject("cup", frozenset({(1, 2)})),)
    assert registry.compare_and_swap(taken, replace(taken, found_objects=found, known_m2=7.0))
    registry.cancel("", NOW)
    there = Destination(SearchKind.GO_TO, (1.5, -2.5))
    registry.start(new_search("b", (), THEN, 2, there))
    assert registry.state is not None
    assert (registry.state.found_objects, registry.state.known_m2) == (found, 7.0)
    with pytest.raises(RequestRejected, match=r"search b for the place \(1.50, -2.50\) is still"):
        registry.reject_if_active()
