"""The state machine: every event in every phase."""

import math
from dataclasses import replace

import pytest

from onemap_planner.search.phases import (
    Approaching,
    Arrived,
    Begun,
    Broken,
    Cancelled,
    Confirmed,
    Confirming,
    Event,
    Exhausted,
    Exploring,
    GivenUp,
    Looking,
    MapLost,
    Moment,
    Over,
    Phase,
    Rejected,
    Search,
    Spotted,
    Starting,
    Turned,
)
from onemap_planner.search.state_machine import begin, status, transition
from onemap_planner.world.candidates import Candidate
from onemap_shared.messages import SearchState

CUP = Candidate((2.0, 1.0, 0.5), frozenset({(20, 10)}), 4, 0.9, 0.8, ((1.0, 1.0),))
THEN = Moment(5.0, 4.0, (0.0, 0.0), 10.0)
NOW = Moment(9.0, 8.0, (1.0, 1.0), 14.0)

PHASES: tuple[Phase, ...] = (
    Starting(),
    Looking(1.0),
    Exploring(),
    Approaching(CUP),
    Confirming(CUP, 6.0),
    Over(SearchState.FOUND),
)
EVENTS: tuple[Event, ...] = (
    Begun(look_around=True),
    Begun(look_around=False),
    Turned(0.5),
    Turned(2 * math.pi),
    MapLost(),
    Spotted(CUP),
    Arrived(CUP),
    Confirmed(CUP),
    Rejected(),
    Exhausted("nothing left"),
    GivenUp("no such word"),
    Broken("stuck"),
    Cancelled(),
)
TABLE: dict[tuple[type, Event], Phase] = {
    (Starting, Begun(look_around=True)): Looking(),
    (Starting, Begun(look_around=False)): Exploring(),
    (Looking, Turned(0.5)): Looking(1.5),
    (Looking, Turned(2 * math.pi)): Exploring(),
    (Looking, Spotted(CUP)): Approaching(CUP),
    (Exploring, Spotted(CUP)): Approaching(CUP),
    (Exploring, MapLost()): Looking(),
    (Exploring, Exhausted("nothing left")): Over(SearchState.NOT_FOUND),
    (Approaching, MapLost()): Looking(),
    (Approaching, Arrived(CUP)): Confirming(CUP, NOW.attentive_s),
    (Approaching, Rejected()): Exploring(),
    (Confirming, MapLost()): Looking(),
    (Confirming, Rejected()): Exploring(),
    (Confirming, Confirmed(CUP)): Over(SearchState.FOUND),
}


def at(phase: Phase, *objects: str) -> Search:
    return replace(begin("id", objects or ("cup",), THEN, 7), phase=phase)


def expected(phase: Phase, event: Event) -> Phase:
    if isinstance(phase, Over):
        return phase
    if isinstance(event, GivenUp | Broken):
        return Over(SearchState.FAILED)
    if isinstance(event, Cancelled):
        return Over(SearchState.CANCELLED)
    return TABLE.get((type(phase), event), phase)


@pytest.mark.parametrize("phase", PHASES, ids=lambda p: type(p).__name__)
@pytest.mark.parametrize("event", EVENTS, ids=lambda e: type(e).__name__)
def test_every_event_in_every_phase(phase: Phase, event: Event) -> None:
    before = at(phase)
    after = transition(before, event, NOW)
    assert after.phase == expected(phase, event)
    if after.phase == phase:
        assert after == before


def test_the_objects_are_sought_in_order_and_one_miss_does_not_end_it() -> None:
    search = at(Exploring(), "cup", "bed", "sofa")
    search = transition(search, Exhausted("searched everything"), NOW)
    assert (search.target, search.phase) == ("bed", Starting())
    search = transition(replace(search, phase=Confirming(CUP, 0.0)), Confirmed(CUP), NOW)
    assert search.target == "sofa"
    search = transition(replace(search, phase=Confirming(CUP, 0.0)), Confirmed(CUP), NOW)
    assert search.phase == Over(SearchState.NOT_FOUND)
    assert search.reason == "found 2 of 3; cup: searched everything"
    assert [result.outcome for result in search.results] == [
        SearchState.NOT_FOUND,
        SearchState.FOUND,
        SearchState.FOUND,
    ]


def test_one_object_given_up_makes_the_whole_search_failed() -> None:
    search = transition(at(Starting(), "qzx", "cup"), GivenUp("no such word"), NOW)
    assert search.target == "cup"
    search = transition(replace(search, phase=Confirming(CUP, 0.0)), Confirmed(CUP), NOW)
    assert search.phase == Over(SearchState.FAILED)


def test_a_result_tells_where_how_long_and_how_far() -> None:
    search = transition(at(Confirming(CUP, 0.0)), Confirmed(CUP), NOW)
    (result,) = search.results
    assert result.position_m == CUP.xyz
    assert result.duration_s == pytest.approx(4.0)
    assert result.path_length_m == pytest.approx(4.0)
    assert (result.start_xy_m, result.end_xy_m) == ((0.0, 0.0), (1.0, 1.0))
    assert result.score == CUP.match


def test_a_search_that_began_without_odometry_starts_where_the_map_answers() -> None:
    search = begin("id", ("cup",), replace(THEN, xy=None), 7)
    assert transition(search, Begun(look_around=False), NOW).leg.xy == NOW.xy


@pytest.mark.parametrize(
    ("phase", "public"),
    [
        (Starting(), SearchState.EXPLORING),
        (Looking(), SearchState.EXPLORING),
        (Exploring(), SearchState.EXPLORING),
        (Approaching(CUP), SearchState.APPROACHING),
        (Confirming(CUP, 0.0), SearchState.CONFIRMING),
        (Over(SearchState.CANCELLED), SearchState.CANCELLED),
    ],
)
def test_the_status_names_the_phase(phase: Phase, public: SearchState) -> None:
    told = status(at(phase), odometer_m=12.0, now_ns=99)
    assert told.state is public
    assert told.active is not isinstance(phase, Over)


def test_the_status_says_what_is_waited_for_while_active() -> None:
    told = status(at(Exploring()), odometer_m=12.0, now_ns=99, waiting="the map is 1.2 s old")
    assert told.reason == "waiting: the map is 1.2 s old"
    assert told.path_length_m == pytest.approx(2.0)
    over = transition(at(Exploring()), Cancelled(), NOW)
    assert status(over, odometer_m=20.0, now_ns=99, waiting="x").reason == "cancelled"
    assert status(over, odometer_m=20.0, now_ns=99).path_length_m == pytest.approx(4.0)
