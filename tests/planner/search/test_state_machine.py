"""The state machine: every event in every phase."""

from dataclasses import replace

import pytest

from onemap_planner.search import state_machine as sm
from onemap_planner.world.candidates import ObjectCandidate, PictureOfObject
from onemap_shared.messages import After, Coverage, FailureCode, SearchKind, SearchState

CUP = ObjectCandidate((2.0, 1.0, 0.5), frozenset({(20, 10)}), 4, 0.9, 0.8, ((1.0, 1.0),))
THEN = sm.EventStamp(5.0, 4.0, (0.0, 0.0), 10.0)
NOW = sm.EventStamp(9.0, 8.0, (1.0, 1.0), 14.0)

THERE = sm.Destination(SearchKind.GO_TO, (1.5, -2.5))


def at(phase: sm.Phase, *objects: str) -> sm.Search:
    if isinstance(phase, sm.Driving):
        return replace(sm.new_search("id", (), THEN, 7, phase.destination), phase=phase)
    return replace(sm.new_search("id", objects or ("cup",), THEN, 7), phase=phase)


def test_objects_are_searched_in_order_and_one_miss_does_not_end_it() -> None:
    search = at(sm.Exploring(), "cup", "bed", "sofa")
    search = sm.transition(search, sm.Ending(SearchState.NOT_FOUND, "searched everything"), NOW)
    assert (search.target, search.phase) == ("bed", sm.Starting())
    search = sm.transition(replace(search, phase=sm.Confirming(CUP, 0.0)), sm.Confirmed(CUP), NOW)
    assert search.target == "sofa"
    search = sm.transition(replace(search, phase=sm.Confirming(CUP, 0.0)), sm.Confirmed(CUP), NOW)
    assert search.phase == sm.Finished(SearchState.NOT_FOUND)
    assert search.reason == "found 2 of 3; cup: searched everything"
    assert [result.outcome for result in search.results] == [
        SearchState.NOT_FOUND,
        SearchState.FOUND,
        SearchState.FOUND,
    ]


@pytest.mark.parametrize(
    ("ends", "state", "reason"),
    [
        (sm.Ending(SearchState.ARRIVED, "there"), SearchState.FOUND, "back where it set out"),
        (sm.Ending(SearchState.FAILED, "no way"), SearchState.FOUND, "set out: no way"),
        (sm.CANCELLED, SearchState.CANCELLED, "cancelled"),
    ],
)
def test_a_search_returns_when_its_last_object_is_done(
    ends: sm.Ending, state: SearchState, reason: str
) -> None:
    search = replace(at(sm.Confirming(CUP, 0.0)), after=After.RETURN)
    returning = sm.transition(search, sm.Confirmed(CUP), NOW)
    assert returning.phase == sm.Driving(sm.Destination(SearchKind.GO_TO, (0.0, 0.0)))
    told = sm.status(returning, replace(NOW, odometer_m=15.0), now_ns=1)
    assert (told.state, told.target, told.start_m) == (SearchState.RETURNING, "", (0.0, 0.0))
    assert (told.active, told.path_length_m, told.left) == (True, 5.0, ())
    over = sm.transition(returning, ends, replace(NOW, odometer_m=17.0))
    told = sm.status(over, NOW, now_ns=1)
    assert (told.state, told.path_length_m, len(told.results)) == (state, 7.0, 1)
    assert told.reason.endswith(reason)
    stopped = sm.transition(search, sm.CANCELLED, NOW)
    assert stopped.phase == sm.Finished(SearchState.CANCELLED)


def test_every_end_has_its_code_coverage_and_evidence() -> None:
    coverage = Coverage(8.0, 10.0, 1.5, (1.0, 2.0), 0.4)
    missed = sm.transition(
        at(sm.Exploring()), sm.Ending(SearchState.NOT_FOUND, "nothing left", coverage=coverage), NOW
    ).results[0]
    assert (missed.coverage, missed.reason_code) == (coverage, FailureCode.NONE)
    blocked = sm.transition(
        at(sm.Driving(THERE)), sm.Ending(SearchState.FAILED, "no way", FailureCode.UNREACHABLE), NOW
    )
    assert sm.status(blocked, NOW, now_ns=1).reason_code is FailureCode.UNREACHABLE
    cancelled = sm.transition(at(sm.Exploring()), sm.CANCELLED, NOW)
    assert sm.status(cancelled, NOW, now_ns=1).reason_code is FailureCode.NONE
    view = PictureOfObject(0.9, 123, (1.0, 2.0, 3.0, 4.0), b"")
    found = sm.transition(
        at(sm.Confirming(CUP, 0.0)), sm.Confirmed(replace(CUP, best_view=view)), NOW
    )
    (result,) = found.results
    assert (result.frame_ns, result.box_px, result.cells) == (123, (1.0, 2.0, 3.0, 4.0), 1)
