"""The planner on a bus, with a robot and a mapper played by the test."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.search.journal import FILE_NAME
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.messages import (
    SearchId,
    SearchState,
    VelocityCommand,
)
from onemap_shared.transport import RemoteError
from onemap_shared.wire import Packet
from tests.planner.simulated_services import House


@pytest.fixture
def house() -> Iterator[House]:
    house = House(PlannerConfig())
    yield house
    house.planner.close()


def moves(command: VelocityCommand) -> bool:
    return (command.linear_mps, command.angular_radps) != (0.0, 0.0)


def test_without_a_search_it_sends_nothing(house: House) -> None:
    for _ in range(5):
        house.frame()
    assert house.driven() == []
    assert house.asked == []
    assert house.planner.health().ready


def test_a_search_moves_the_robot_and_publishes_its_state(house: House) -> None:
    told = house.start("sofa", "bed")
    assert told.state is SearchState.EXPLORING
    assert told.target == "sofa"
    house.until(lambda: any(map(moves, house.driven())))
    assert house.resets == [told.search_id]
    assert set(house.asked) == {"sofa"}
    first = house.states.take(0.0)
    assert first is not None
    assert first.search_id == told.search_id
    path = house.paths.take(1.0)
    assert path is not None
    metrics = house.planner.health().metrics or {}
    assert {"plan_ms", "view_age_s", "odometry_age_s", "goals", "stops_on_stale", "control_hz"} <= (
        set(metrics)
    )


def test_a_search_that_is_over_keeps_the_time_of_its_end(house: House) -> None:
    told = house.start("sofa")
    house.until(lambda: house.get().reason != told.reason)
    ended = house.caller.call(keys.SEARCH_CANCEL, SearchId(told.search_id))
    while house.states.take(0.0) is not None:
        pass
    house.until(lambda: (later := house.states.take(0.0)) is not None and later == ended)
    house.start("bed")
    house.frame()
    assert house.get(told.search_id) == ended
    assert house.get().updated_ns > ended.updated_ns


def test_cancel_brakes_and_allows_another_search(house: House) -> None:
    first = house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    assert house.caller.call(keys.SEARCH_CANCEL, SearchId()).state is SearchState.CANCELLED
    house.driven()
    house.frame()
    house.until(lambda: bool(last := house.driven()) and not any(map(moves, last)))
    assert house.get(first.search_id).state is SearchState.CANCELLED
    second = house.start("bed")
    assert second.search_id != first.search_id
    assert house.get(first.search_id).objects == ("sofa",)


@pytest.mark.parametrize("missing", ["odometry", "revision"])
def test_it_stops_when_a_stream_falls_silent_and_says_so(house: House, missing: str) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    streams = {missing: False}
    house.until(lambda: "waiting:" in house.get().reason, **streams)
    house.driven()
    house.frame(**streams)
    house.frame(**streams)
    assert not any(map(moves, house.driven()))
    problem = house.planner.health().problem
    assert {"odometry": "odometry", "revision": "the map"}[missing] in problem
    house.until(lambda: any(map(moves, house.driven())))  # fresh again: it goes on
    assert "waiting" not in house.get().reason


@pytest.mark.parametrize(
    ("topic", "metric"),
    [
        (keys.ROBOT_ODOMETRY, "odometry_refused"),
        (keys.MAP_REVISION, "revision_refused"),
        (keys.DETECTIONS, "detections_refused"),
    ],
)
def test_garbage_on_its_topics_is_counted_and_passed_over(
    house: House, topic: keys.Topic, metric: str
) -> None:
    house.start("sofa")
    house.hub.inject(topic.key, Packet(b"garbage", b"\x00" * 9))
    house.until(
        lambda: (house.planner.health().metrics or {})[metric] == 1.0,
        odometry=False,
        revision=False,
    )
    house.until(lambda: any(map(moves, house.driven())))


def test_a_killed_planner_goes_on_with_its_search(tmp_path: Path) -> None:
    config = PlannerConfig(state_dir=tmp_path)
    house = House(config)
    told = house.start("sofa", "bed")
    house.until(lambda: (tmp_path / FILE_NAME).exists() and bool(house.resets))
    house.planner._planning_thread.close()  # killed: nothing is tidied up
    house.planner = Planner(house.hub.bus("planner"), config)
    assert house.get().search_id == told.search_id
    house.driven()
    house.until(lambda: any(map(moves, house.driven())))
    assert house.resets == [told.search_id]  # what was searched stays searched
    house.caller.call(keys.SEARCH_CANCEL, SearchId())
    house.until(lambda: not (tmp_path / FILE_NAME).exists())
    house.planner.close()


def test_a_broken_journal_does_not_keep_the_planner_from_starting(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text(json.dumps({"schema": 99}))
    house = House(PlannerConfig(state_dir=tmp_path))
    house.frame()
    with pytest.raises(RemoteError):
        house.get()
    house.planner.close()


def test_closing_stops_the_robot(house: House) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    house.planner.close()
    assert not moves(house.driven()[-1])


def test_silence_without_a_search_is_a_problem_after_a_while(house: House) -> None:
    health = house.planner.health()
    assert not health.ready
    assert health.problem == "odometry has never arrived"
    assert np.isfinite(list((health.metrics or {}).values())).all()
