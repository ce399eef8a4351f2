"""The planning thread waits for a slow or missing mapper, and the control loop does not."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from onemap_planner.config import PlannerConfig
from onemap_shared import keys
from onemap_shared.messages import (
    SearchState,
    SearchView,
    SearchViewRequest,
    VelocityCommand,
)
from tests.planner.drawn_maps import search_view_of
from tests.planner.simulated_services import ROOM, House


@pytest.fixture
def house() -> Iterator[House]:
    house = House(PlannerConfig())
    yield house
    house.planner.close()


def moves(command: VelocityCommand) -> bool:
    return (command.linear_mps, command.angular_radps) != (0.0, 0.0)


def test_a_slow_mapper_does_not_hold_up_commands(house: House) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    asked, release = threading.Event(), threading.Event()

    def slow(request: SearchViewRequest) -> SearchView:
        asked.set()
        release.wait(5.0)
        return search_view_of(ROOM, request.text)

    house.answer = slow
    house.until(asked.is_set)
    house.driven()
    sent: list[VelocityCommand] = []
    while len(sent) < 5:
        house.frame()
        sent += house.driven()
    assert not release.is_set()
    assert any(map(moves, sent))  # the last plan is still young
    release.set()


def test_a_missing_mapper_is_waited_for(house: House) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    house.mapper.close()
    house.until(lambda: house.get().reason == "waiting: the mapper is not there")
    back = house.hub.bus("mapper")
    back.serve(keys.MAP_SEARCH_VIEW, house._view)
    back.serve(keys.MAP_SEARCH_RESET, house._reset)
    house.until(lambda: "waiting" not in house.get().reason)
    house.until(lambda: any(map(moves, house.driven())))


def test_a_word_the_map_does_not_know_fails_that_object(house: House) -> None:
    def refuse(request: SearchViewRequest) -> SearchView:
        raise ValueError("the encoder does not know 'qzxw'")

    house.answer = refuse
    house.start("qzxw")
    house.until(lambda: not house.get().active)
    assert house.get().state is SearchState.FAILED
    assert "does not know 'qzxw'" in house.get().reason


def test_a_dead_planning_thread_takes_the_process_down(house: House) -> None:
    house.planner._planning_thread.close()
    with pytest.raises(RuntimeError, match="planning thread died"):
        house.planner.step(0.0)
