"""A recorded search goes on where it was; a broken record is refused with the reason."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from onemap_planner.search import decision_log, journal
from onemap_planner.search.journal import (
    FILE_NAME,
    MAX_FILE_BYTES,
    SET_ASIDE,
    JournalError,
    Surroundings,
    mark_interrupted,
    set_aside,
)
from onemap_planner.search.state_machine import (
    CANCELLED,
    Budget,
    Destination,
    Driving,
    Ending,
    EventStamp,
    Exploring,
    Search,
    Starting,
    TargetStart,
    new_search,
    status,
    transition,
)
from onemap_shared.messages import (
    Coverage,
    Detail,
    Relation,
    RelationKind,
    SearchKind,
    SearchState,
)

THEN = EventStamp(5.0, 4.0, (0.5, -1.0), 10.0)
NOW = EventStamp(9.0, 8.0, (1.0, 1.0), 14.0)
ENDED = Ending(SearchState.INTERRUPTED, "x", whole=True)
AROUND = Surroundings("r1", "b1", 50.0, "ros2 i1", "m1", 7, (1.0, 2.0))


def save(folder: Path, search: Search, *, now_s: float, odometer_m: float) -> None:
    journal.save(folder, search, AROUND, now_s=now_s, now_ns=10**18, odometer_m=odometer_m)


def load(folder: Path, now_s: float) -> Search | None:
    recorded = journal.load(folder, now_s)
    return None if recorded is None else recorded.search


def test_what_a_search_rests_on_and_why_it_has_ended_are_kept(tmp_path: Path) -> None:
    search = new_search("id", ("cup",), THEN, 7)
    save(tmp_path, search, now_s=6.0, odometer_m=11.0)
    recorded = journal.load(tmp_path, now_s=1000.0)
    assert recorded is not None
    assert (recorded.around, recorded.written_ns, recorded.interrupted) == (AROUND, 10**18, "")
    mark_interrupted(tmp_path, "the planner was stopped")
    save(tmp_path, transition(search, ENDED, NOW), now_s=9.0, odometer_m=14.0)
    recorded = journal.load(tmp_path, now_s=1000.0)
    assert recorded is not None
    assert (recorded.search.active, recorded.interrupted) == (True, "the planner was stopped")


def test_the_search_goes_on_at_its_object(tmp_path: Path) -> None:
    search = replace(new_search("id", ("cup", "bed"), THEN, 7), phase=Exploring())
    beside = Detail(relations=(Relation(RelationKind.NEXT_TO, ("sink",)),), outside=("hall",))
    search = replace(search, budget=Budget(40.0, 300.0))
    search = replace(search, details=(Detail("red"), beside), stay_out=("nursery",))
    coverage = Coverage(8.0, 10.0, 1.5, (1.0, 2.0), 0.4)
    search = transition(
        search, Ending(SearchState.NOT_FOUND, "nothing left", coverage=coverage), NOW
    )
    save(tmp_path, search, now_s=19.0, odometer_m=17.0)
    restored = load(tmp_path, now_s=1000.0)
    assert restored is not None
    assert (restored.search_id, restored.target, restored.phase) == ("id", "bed", Starting())
    assert restored.objects == search.objects
    assert restored.results == search.results
    assert restored.budget == search.budget
    assert (restored.detail, restored.details) == (beside, search.details)
    assert restored.stay_out == ("nursery",)
    assert restored.started_ns == 7
    assert 1000.0 - restored.target_start.since_s == pytest.approx(10.0)
    assert status(restored, odometer_m=0.0, now_ns=0).path_length_m == pytest.approx(7.0)


WRITTEN_BY_RELEASE_1 = """{"schema": 1, "search_id": "abc", "objects": ["the sofa", "cup", "bed"],
"results": [{"name": "the sofa", "outcome": "found", "reason": "found at (1.00, 2.00)",
"position_m": [1.0, 2.0, 0.5], "score": 0.7, "duration_s": 10.0, "path_length_m": 3.0,
"start_xy_m": [1.0, 2.0], "end_xy_m": [2.0, 2.0]}], "started_ns": 123, "elapsed_s": 10.0,
"path_length_m": 2.0, "start_xy_m": [2.0, 2.0]}"""


def test_a_journal_of_an_earlier_release_is_read(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text(WRITTEN_BY_RELEASE_1)
    recorded = journal.load(tmp_path, now_s=50.0)
    assert recorded is not None
    assert recorded.around == Surroundings()
    restored = recorded.search
    assert (restored.search_id, restored.target, restored.index) == ("abc", "cup", 1)
    (result,) = restored.results
    assert (result.name, result.outcome, result.score) == ("the sofa", SearchState.FOUND, 0.7)
    assert restored.target_start == TargetStart(40.0, 0.0, (2.0, 2.0), -2.0)


def test_a_search_that_is_over_leaves_no_journal(tmp_path: Path) -> None:
    search = new_search("id", ("cup",), THEN, 7)
    save(tmp_path / "new", search, now_s=6.0, odometer_m=11.0)
    save(tmp_path / "new", transition(search, CANCELLED, NOW), now_s=9.0, odometer_m=14.0)
    assert load(tmp_path / "new", 0.0) is None
    assert list((tmp_path / "new").iterdir()) == []


def test_a_drive_goes_on_to_its_place(tmp_path: Path) -> None:
    there = Destination(SearchKind.LOOK_AT, (1.5, -2.5))
    search = replace(new_search("id", (), THEN, 7, there), phase=Driving(there))
    save(tmp_path, search, now_s=6.0, odometer_m=11.0)
    restored = load(tmp_path, now_s=1000.0)
    assert restored is not None
    assert (restored.destination, restored.phase, restored.objects) == (there, Starting(), ())
    assert restored.kind is SearchKind.LOOK_AT
    save(tmp_path, transition(search, CANCELLED, NOW), now_s=9.0, odometer_m=14.0)
    assert load(tmp_path, 0.0) is None


def changed(**changes: Any) -> str:
    """The journal of release 1 with members replaced, as text."""
    return json.dumps(json.loads(WRITTEN_BY_RELEASE_1) | changes)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\x00\x01",
        changed(schema=2),
        changed(objects=[]),
        changed(results=[{}]),
        changed(kind="fly"),
        changed(objects=[], results=[], kind="go_to"),
        changed(objects=["cup"], results=[], index=1),
        changed(start_xy_m=[1.0]),
        changed(elapsed_s=10**400),
        changed(started_ns=-1),
        "[" * 100_000,
        changed(objects=["\ud800a", "cup", "bed"]),
        changed(search_id="../../etc/x"),
        changed(elapsed_s=float("nan")),
        changed(path_length_m=1e308),
        changed(results=[json.loads(WRITTEN_BY_RELEASE_1)["results"][0] | {"score": "high"}]),
        changed(
            paused=[{"index": 7, "spent_s": 0, "spent_active_time_s": 0, "driven_m": 0, "xy": None}]
        ),
        changed(around={"boot_s": "x"}),
        " " * (MAX_FILE_BYTES + 1),
    ],
)
def test_a_broken_journal_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE_NAME).write_text(text)
    with pytest.raises(JournalError, match=FILE_NAME):
        load(tmp_path, 0.0)


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.integers(10**18, 10**40)
    | st.floats()
    | st.text(st.characters(), max_size=5)
    | st.sampled_from(["find", "go_to", "any", "found", "failed", "cup"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=4,
)
MEMBERS = (*json.loads(WRITTEN_BY_RELEASE_1), "kind", "place_m", "order", "index", "done", "paused")
MEMBERS += ("around", "written_ns", "interrupted", "details", "stay_out")


@given(
    changes=st.dictionaries(st.sampled_from(MEMBERS), VALUES, max_size=4),
    result=st.dictionaries(
        st.sampled_from(("name", "outcome", "score", "coverage", "box_px", "end_xy_m", "reason")),
        VALUES,
        max_size=2,
    ),
)
@settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_journal_of_any_content_is_refused_or_goes_on(
    tmp_path: Path, changes: dict[str, Any], result: dict[str, Any]
) -> None:
    document = json.loads(WRITTEN_BY_RELEASE_1)
    document["results"][0] |= result
    (tmp_path / FILE_NAME).write_text(json.dumps(document | changes))
    try:
        search = load(tmp_path, 100.0)
    except JournalError:
        return
    assert search is not None
    save(tmp_path, search, now_s=101.0, odometer_m=1.0)
    decision_log.record(tmp_path, status(search, odometer_m=1.0, now_ns=1), None)


def test_a_journal_that_cannot_be_used_is_set_aside(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text("{")
    assert SET_ASIDE in set_aside(tmp_path)
    assert (tmp_path / SET_ASIDE).read_text() == "{"
    assert load(tmp_path, 0.0) is None
    assert "cannot be renamed" in set_aside(tmp_path)


def test_a_journal_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).mkdir()
    with pytest.raises(JournalError, match="cannot read"):
        load(tmp_path, 0.0)
