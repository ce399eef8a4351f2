"""Turns of the objects of a search in any order; what was spent on each adds up."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_planner.search.phases import (
    Approaching,
    Confirming,
    EventStamp,
    Exhausted,
    Exploring,
    LookingAround,
    Reordered,
    Search,
    Starting,
)
from onemap_planner.search.state_machine import new_search, status, transition
from onemap_planner.search.turns import waiting
from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.messages import SearchOrder, SearchState

GONE = Exhausted("nothing left")


def at(seconds: float) -> EventStamp:
    """A stamp at these seconds, with half as many metres driven."""
    return EventStamp(seconds, seconds, (seconds, 0.0), seconds / 2)


def exploring(search: Search) -> Search:
    assert search.phase == Starting()
    return replace(search, phase=Exploring())


def started() -> Search:
    names = ("cup", "bed", "sofa")
    return exploring(new_search("id", names, at(0.0), 7, order=SearchOrder.ANY))


def test_another_object_is_preferred_and_the_present_one_goes_on_later() -> None:
    search = transition(started(), Reordered((2, 0, 1)), at(10.0))
    assert (search.target, waiting(search)) == ("sofa", (0, 1))
    assert search.reason == "asking the map about 'sofa'"
    search = transition(exploring(search), Reordered((0, 2, 1)), at(14.0))
    assert (search.target, waiting(search)) == ("cup", (1, 2))
    search = transition(exploring(search), GONE, at(19.0))
    search = transition(exploring(search), GONE, at(20.0))
    search = transition(exploring(search), GONE, at(30.0))
    assert [result.name for result in search.results] == ["cup", "sofa", "bed"]
    assert [result.duration_s for result in search.results] == [15.0, 5.0, 10.0]
    assert [result.path_length_m for result in search.results] == [7.5, 2.5, 5.0]
    assert [result.start_xy_m[0] for result in search.results] == [0.0, 10.0, 20.0]
    assert not search.active


def test_the_way_of_an_object_that_waits_counts_for_the_search() -> None:
    search = transition(started(), Reordered((1, 0, 2)), at(10.0))
    message = status(search, odometer_m=8.0, now_ns=0)
    assert message.path_length_m == pytest.approx(8.0)
    assert (message.order, message.objects, message.index) == (
        SearchOrder.ANY,
        ("cup", "bed", "sofa"),
        1,
    )
    assert message.state is SearchState.EXPLORING


def test_the_same_first_object_goes_on_undisturbed() -> None:
    before = started()
    search = transition(before, Reordered((0, 2, 1)), at(10.0))
    assert search == replace(before, planned=(0, 2, 1))
    assert transition(search, GONE, at(11.0)).target == "sofa"


def test_only_an_exploration_is_given_up_for_another_object() -> None:
    before = started()
    cup = ObjectCandidate((2.0, 1.0, 0.5), frozenset({(20, 10)}), 4, 0.9, 0.8, ((1.0, 1.0),))
    for phase in (Starting(), LookingAround(1.0), Approaching(cup), Confirming(cup, 0.0)):
        search = replace(before, phase=phase)
        assert transition(search, Reordered((2, 0, 1)), at(10.0)) is search


def test_a_given_order_goes_by_the_list() -> None:
    search = exploring(new_search("id", ("cup", "bed", "cup"), at(0.0), 7))
    names = []
    for second in (1.0, 2.0, 3.0):
        names.append(search.target)
        search = transition(replace(search, phase=Exploring()), GONE, at(second))
    assert names == ["cup", "bed", "cup"]
    assert search.done == (0, 1)
