"""A recorded search goes on where it was; a broken record is refused with the reason."""

from dataclasses import replace
from pathlib import Path

import pytest

from onemap_planner.policy.state import PlannerState
from onemap_planner.registry import MAX_PAST_SEARCHES, SearchRegistry
from onemap_planner.search.events import Cancelled, EventStamp, Exhausted
from onemap_planner.search.journal import FILE_NAME, JournalError, load, save
from onemap_planner.search.phases import Exploring, Starting
from onemap_planner.search.state_machine import new_search, status, transition
from onemap_shared.transport import RequestRejected

THEN = EventStamp(5.0, 4.0, (0.5, -1.0), 10.0)
NOW = EventStamp(9.0, 8.0, (1.0, 1.0), 14.0)


def test_the_search_goes_on_at_its_object(tmp_path: Path) -> None:
    search = replace(new_search("id", ("cup", "bed"), THEN, 7), phase=Exploring())
    search = transition(search, Exhausted("nothing left"), NOW)
    save(tmp_path, search, now_s=19.0, odometer_m=17.0)
    restored = load(tmp_path, now_s=1000.0)
    assert restored is not None
    assert (restored.search_id, restored.target, restored.phase) == ("id", "bed", Starting())
    assert restored.objects == search.objects
    assert restored.results == search.results
    assert restored.started_ns == 7
    assert 1000.0 - restored.target_start.since_s == pytest.approx(10.0)
    assert status(restored, odometer_m=0.0, now_ns=0).path_length_m == pytest.approx(7.0)


def test_a_search_that_is_over_leaves_no_record(tmp_path: Path) -> None:
    search = new_search("id", ("cup",), THEN, 7)
    save(tmp_path / "new", search, now_s=6.0, odometer_m=11.0)
    save(tmp_path / "new", transition(search, Cancelled(), NOW), now_s=9.0, odometer_m=14.0)
    assert load(tmp_path / "new", 0.0) is None
    assert list((tmp_path / "new").iterdir()) == []


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"schema": 2}',
        '{"schema": 1, "objects": ["cup"], "results": [], "start_xy_m": null}',
        '{"schema": 1, "objects": [], "results": [], "start_xy_m": null}',
        '{"schema": 1, "objects": ["cup"], "results": [{}], "start_xy_m": null}',
        "\x00\x01",
    ],
)
def test_a_broken_record_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE_NAME).write_text(text)
    with pytest.raises(JournalError, match=FILE_NAME):
        load(tmp_path, 0.0)


def test_one_search_at_a_time() -> None:
    registry = SearchRegistry()
    first = registry.start("a", ("cup",), THEN, 1)
    with pytest.raises(RequestRejected, match="search a is still looking for 'cup'") as refused:
        registry.start("b", ("bed",), THEN, 2)
    assert refused.value.code == "conflict"
    registry.cancel("a", NOW)
    assert not registry.find("a").active
    assert registry.start("b", ("bed",), THEN, 2).search_id == registry.find("").search_id
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


def test_a_search_cancelled_during_a_thought_stays_cancelled() -> None:
    registry = SearchRegistry()
    registry.start("a", ("cup",), THEN, 1)
    taken = registry.state
    assert taken is not None
    registry.cancel("", NOW)
    assert not registry.compare_and_swap(taken, replace(taken, active_time_s=1.0))
    assert registry.state is not None
    assert not registry.state.search.active


def test_the_end_of_a_search_is_noted_once_whoever_ends_it() -> None:
    times = iter([100, 200])
    registry = SearchRegistry(clock_ns=lambda: next(times))
    registry.start("a", ("cup",), THEN, 1)
    taken = registry.state
    assert taken is not None
    exploring = replace(taken.search, phase=Exploring())
    given_up = transition(exploring, Exhausted("nothing left"), NOW)
    assert registry.compare_and_swap(taken, replace(taken, search=given_up))
    registry.start("b", ("bed",), THEN, 150)
    registry.cancel("b", NOW)
    for search_id, ended_ns in (("a", 100), ("b", 200), ("b", 200)):
        told = status(registry.cancel(search_id, NOW), odometer_m=0.0, now_ns=999)
        assert told.updated_ns == ended_ns


def test_old_searches_are_forgotten_one_day() -> None:
    registry = SearchRegistry()
    for number in range(MAX_PAST_SEARCHES + 2):
        registry.start(str(number), ("cup",), THEN, number)
        registry.cancel("", NOW)
    with pytest.raises(RequestRejected):
        registry.find("0")
    assert registry.find("5").search_id == "5"


def test_a_restored_search_is_the_newest() -> None:
    search = new_search("a", ("cup",), THEN, 1)
    registry = SearchRegistry(search)
    assert registry.state == PlannerState(search)
