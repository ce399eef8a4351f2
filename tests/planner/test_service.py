"""The planner on a bus, with a robot and a mapper played by the test."""

from __future__ import annotations

import json
import math
import os
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.search import decision_log
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.clock import SystemClock
from onemap_shared.keys import Procedure
from onemap_shared.messages import (
    SearchId,
    SearchKind,
    SearchListRequest,
    SearchState,
    VelocityCommand,
    ViewChangesRequest,
)
from onemap_shared.transport import RemoteError
from tests.planner.one_room import visited
from tests.planner.simulated_services import SimulatedServices, moves


def test_without_a_search_it_sends_nothing(services: SimulatedServices) -> None:
    for _ in range(5):
        services.frame()
    assert services.sent_commands() == []
    assert services.asked == []
    assert services.planner.health().ready


def test_a_command_names_the_frame_of_its_plan_and_the_last_one_stops_the_robot(
    services: SimulatedServices,
) -> None:
    view = services.answer
    services.answer = lambda request: replace(view(request), stamp_ns=services.newest_ns + 77)
    services.start("sofa")
    sent: list[VelocityCommand] = []

    def moved() -> bool:
        sent.extend(services.sent_commands())
        return any(map(moves, sent))

    services.until(moved)
    assert {command.frame_ns % 10**6 for command in sent if moves(command)} == {77}
    services.planner.close()
    last = services.sent_commands()[-1]
    assert not moves(last)
    assert last.frame_ns == 0  # the last stop rests on none


@pytest.mark.parametrize("changed", ["map", "places"])
def test_a_stop_rests_on_no_plan_of_another_map_or_other_places(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch, changed: str
) -> None:
    view = services.answer
    services.answer = lambda request: replace(view(request), stamp_ns=services.newest_ns + 77)
    services.map_id = "before"
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.planner._planning_thread.close()
    monkeypatch.setattr(type(services.planner._planning_thread), "alive", True)
    if changed == "map":
        services.map_id = "loaded"
    else:
        services.places_version += 1
    services.frame()
    services.sent_commands()
    services.frame()
    stops = services.sent_commands()
    assert [(moves(each), each.frame_ns) for each in stops] == [(False, 0)] * len(stops) != []


def test_a_new_plan_does_not_wait_for_the_next_period_of_control(
    services: SimulatedServices,
) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.planner._next_control_s = math.inf
    view = services.answer
    services.answer = lambda request: replace(view(request), stamp_ns=services.newest_ns + 77)
    services.until(lambda: 77 in {each.frame_ns % 10**6 for each in services.sent_commands()})


def test_a_search_moves_the_robot_and_publishes_its_state(services: SimulatedServices) -> None:
    started = services.start("sofa", "bed")
    assert started.state is SearchState.EXPLORING
    assert started.target == "sofa"
    services.until(lambda: any(map(moves, services.sent_commands())))
    assert services.resets == [started.search_id]
    assert set(services.asked) == {"sofa"}
    first = services.states.take(0.0)
    assert first is not None
    assert first.search_id == started.search_id
    path = services.paths.take(1.0)
    assert path is not None
    metrics = services.planner.health().metrics or {}
    assert {"plan_ms", "view_age_s", "odometry_age_s", "goals", "stops_on_stale", "control_hz"} <= (
        set(metrics)
    )
    assert {"loop_s", "odometry_delay_s", "monitor_slowdowns", "monitor_stops"} <= set(metrics)


def test_a_search_that_is_over_keeps_the_time_of_its_end(services: SimulatedServices) -> None:
    started = services.start("sofa")
    services.until(lambda: services.get().reason != started.reason)
    ended = services.caller.call(keys.SEARCH_CANCEL, SearchId(started.search_id))
    while services.states.take(0.0) is not None:
        pass
    services.until(lambda: (later := services.states.take(0.0)) is not None and later == ended)
    services.start("bed")
    services.frame()
    assert services.get(started.search_id) == ended
    assert services.get().updated_ns > ended.updated_ns


def test_cancel_brakes_and_allows_another_search(services: SimulatedServices) -> None:
    first = services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    assert services.caller.call(keys.SEARCH_CANCEL, SearchId()).state is SearchState.CANCELLED
    services.sent_commands()
    services.frame()
    services.until(lambda: bool(last := services.sent_commands()) and not any(map(moves, last)))
    assert services.get(first.search_id).state is SearchState.CANCELLED
    second = services.start("bed")
    assert second.search_id != first.search_id
    assert services.get(first.search_id).objects == ("sofa",)


def test_a_cancel_stops_the_searches_of_all_planners(services: SimulatedServices) -> None:
    """Two planners, as of an earlier release that did not refuse to be the second."""
    first = services.start("sofa")
    second = Planner(services.router.bus("planner"), PlannerConfig())
    other = services.start("bed")  # the second took over the key
    assert other.search_id != first.search_id
    cancelled = services.caller.call(keys.SEARCH_CANCEL, SearchId(first.search_id))
    assert (cancelled.search_id, cancelled.state) == (first.search_id, SearchState.CANCELLED)
    assert services.get(other.search_id).state is SearchState.CANCELLED
    second.close()


def test_alone_a_cancel_of_another_search_stops_nothing(services: SimulatedServices) -> None:
    services.start("sofa")
    with pytest.raises(RemoteError, match="there is no search"):
        services.caller.call(keys.SEARCH_CANCEL, SearchId("other"))
    assert services.get().active


@pytest.mark.parametrize("role", ["robot", "mapper"])
def test_it_stops_while_two_of_a_role_send(services: SimulatedServices, role: str) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    another = services.router.bus(role)
    services.until(lambda: f"2 processes run as the {role}" in services.get().reason)
    services.sent_commands()
    services.frame()
    assert not any(map(moves, services.sent_commands()))
    another.close()
    services.until(lambda: any(map(moves, services.sent_commands())))


def test_it_moves_no_robot_that_follows_another_planner(services: SimulatedServices) -> None:
    services.start("sofa")
    rival = VelocityCommand(1, 5, 0.0, 0.0, planner="rival")
    services.gate, _ = services.gate.receive(rival, float("inf"), 0)  # and is never let go
    services.until(lambda: "the robot follows another planner" in services.get().reason)
    assert not any(map(moves, services.sent_commands()))


@pytest.mark.parametrize("missing", ["odometry", "revision"])
def test_it_stops_when_a_stream_falls_silent_and_says_so(
    services: SimulatedServices, missing: str
) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    streams = {missing: False}
    services.until(lambda: ": none for " in services.get().reason, **streams)
    services.sent_commands()
    services.frame(**streams)
    services.frame(**streams)
    assert not any(map(moves, services.sent_commands()))
    problem = services.planner.health().problem
    assert {"odometry": "the robot's position", "revision": "the map"}[missing] in problem
    services.until(lambda: any(map(moves, services.sent_commands())))  # fresh again: it goes on
    assert "waiting" not in services.get().reason


def test_another_map_of_the_same_size_resets_what_came_from_the_one_before(
    services: SimulatedServices,
) -> None:
    shown = "m1"
    view = services.answer
    services.answer = lambda request: replace(view(request), map_id=shown)
    services.start("sofa")
    services.until(lambda: bool(services.get().choice.options))
    registry = services.planner._registry
    swapped = False
    while not swapped:
        known = registry.state
        assert known is not None
        given_up = replace(known, ledger=visited((9.0, 9.0)))
        swapped = registry.compare_and_swap(known, given_up)
    shown = "m2"
    services.until(lambda: "the map began anew" in services.get().reason)
    state = registry.state
    assert state is not None
    assert all(each.xy != (9.0, 9.0) for each in state.ledger.attempts)
    services.until(lambda: any(map(moves, services.sent_commands())))


@pytest.mark.parametrize("lag_s", [4.0, 8.0, 3600.0, -0.7, -3600.0])
def test_it_stands_while_stamps_of_map_and_odometry_do_not_fit(
    services: SimulatedServices, lag_s: float
) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.lag_s = lag_s
    services.until(lambda: "waiting for the camera" in services.get().reason)
    services.sent_commands()
    for _ in range(5):
        services.frame()
    assert not any(map(moves, services.sent_commands()))
    services.lag_s = 0.0
    services.until(lambda: any(map(moves, services.sent_commands())))


def test_a_map_that_answers_what_cannot_be_read_is_waited_for(
    services: SimulatedServices,
) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    broken = services.router.bus()
    foreign = Procedure(keys.MAP_VIEW_CHANGES.key, ViewChangesRequest, ViewChangesRequest)
    broken.serve(foreign, lambda asked: asked)
    services.until(lambda: "waiting for the map: its answer on" in services.get().reason)
    services.until(lambda: bool(last := services.sent_commands()) and not any(map(moves, last)))
    broken.close()
    services.until(lambda: any(map(moves, services.sent_commands())))


@pytest.mark.parametrize("end", ["told", "killed", "crashed"])
def test_no_planner_goes_on_with_the_search_of_another(
    tmp_path: Path, end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    services = SimulatedServices(PlannerConfig(state_dir=tmp_path))
    started = services.start("sofa", "bed")
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.until(lambda: bool(decision_log.past(tmp_path)))
    if end == "crashed":
        monkeypatch.setattr(services.planner, "_control", lambda _: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            services.until(lambda: False)
    if end != "killed":
        services.sent_commands()
        services.planner.close()
        assert not any(map(moves, services.sent_commands()))
    services.kill_planner()
    while services.states.take(0.0) is not None:
        pass
    services.start_planner()
    for _ in range(20):
        services.frame()
    assert not any(map(moves, services.sent_commands()))
    status = services.get()
    assert services.states.take(0.0) == status  # who looks is told, and may ask again
    assert (status.search_id, status.state) == (started.search_id, SearchState.INTERRUPTED)
    assert [(each.name, each.outcome) for each in status.results] == [
        ("sofa", SearchState.INTERRUPTED)
    ]
    assert status.reason.startswith("interrupted at 20")
    assert status.again(2.0).objects == ("sofa", "bed")
    again = services.caller.call(keys.SEARCH_START, status.again(2.0))
    services.until(lambda: any(map(moves, services.sent_commands())))
    assert (services.get().search_id, services.get().active) == (again.search_id, True)
    assert again.continues == started.search_id
    services.caller.call(keys.SEARCH_CANCEL, SearchId(again.search_id))
    with pytest.raises(
        RemoteError, match=f"{started.search_id} was continued as {again.search_id}"
    ):
        services.caller.call(keys.SEARCH_START, status.again(2.0))  # repeated after a lost answer
    assert not services.get().active
    services.planner.close()


@pytest.mark.parametrize(
    ("named", "joined", "away"),
    [(True, True, 0), (True, False, 0), (False, True, 0), (False, False, 0), (True, True, 30)],
)
def test_a_search_ends_with_the_driver_that_it_was_accepted_for(
    services: SimulatedServices, named: bool, joined: bool, away: int
) -> None:
    """However soon another one is there, and wherever the robot stands then."""
    services.restart_driver(named=named, joined=joined)
    services.frame()
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    for _ in range(away):
        services.frame(odometry=False)
    services.sent_commands()
    services.restart_driver(named=named, joined=joined)
    services.until(lambda: not services.get().active)
    for _ in range(20):
        services.frame()
    driven = [command for command in services.sent_commands() if moves(command)]
    assert all(command.driver not in ("", services.gate.driver) for command in driven) or not named
    assert len(driven) <= 1  # until its first odometry: made for the driver before
    status = services.get()
    assert status.state is SearchState.INTERRUPTED
    assert "driver was restarted" in status.reason
    services.caller.call(keys.SEARCH_START, status.again(2.0))
    services.until(lambda: any(map(moves, services.sent_commands())))


@pytest.mark.parametrize("drive", [True, False])
def test_no_drive_goes_on_to_coordinates_of_a_map_that_was_replaced(
    services: SimulatedServices, drive: bool
) -> None:
    services.map_id = "before"
    services.frame()
    search_id = services.go_to(7.0, 7.0).search_id if drive else services.start("sofa").search_id
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.map_id = "loaded"
    services.until(lambda: services.planner._registry.find(search_id).start_lost)
    assert services.get(search_id).active is not drive
    if drive:
        assert services.get(search_id).state is SearchState.FAILED
        assert "the map was replaced" in services.get(search_id).reason
        services.sent_commands()
        services.frame()
        assert not any(map(moves, services.sent_commands()))


def test_a_driver_that_lost_the_router_is_no_other(services: SimulatedServices) -> None:
    services.restart_driver(named=False, joined=True)
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    (joined,) = [each for each in services.router.services if each is services.robot]
    del services.router.services[joined]
    services.frame(odometry=False)
    services.router.services[joined] = "robot"
    services.sent_commands()
    services.until(lambda: any(map(moves, services.sent_commands())))
    assert services.get().active


@pytest.mark.parametrize(("away_s", "goes_on"), [(50.0, True), (70.0, False)])
def test_a_search_does_not_outlive_a_long_suspend(
    tmp_path: Path, away_s: float, goes_on: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    services = SimulatedServices(PlannerConfig(state_dir=tmp_path))
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    asleep_s = [0.0]
    monkeypatch.setattr(SystemClock, "suspended_s", lambda _: asleep_s[0])
    services.frame()
    services.sent_commands()
    asleep_s[0] = away_s
    for _ in range(5):
        services.frame()
    assert any(map(moves, services.sent_commands())) is goes_on
    assert services.get().active is goes_on
    assert goes_on or "the planner stood still for 70 s" in services.get().reason
    services.planner.close()


def test_every_decision_is_recorded_in_a_file_of_the_search(tmp_path: Path) -> None:
    services = SimulatedServices(PlannerConfig(state_dir=tmp_path))
    started = services.start("sofa")
    services.until(lambda: bool(services.get().choice.options))
    services.until(lambda: bool(list((tmp_path / "decisions").glob("*"))))
    (path,) = (tmp_path / "decisions").iterdir()
    services.until(lambda: "waiting for" in services.get().reason, odometry=False)
    services.frame(odometry=False)
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    services.until(lambda: "cancelled" in path.read_text())
    assert "waiting for" not in path.read_text()  # which is no decision
    assert path.stem.endswith(started.search_id)
    steps = [json.loads(line) for line in path.read_text().splitlines()]
    assert steps[-1]["state"] == "cancelled"
    assert any(step["choice"] and step["choice"]["number"] == 1 for step in steps)
    recorded = services.caller.call(keys.SEARCH_RECORD, SearchId())
    assert recorded.status == services.get()
    assert len(recorded.steps) == len(steps)
    assert len(recorded.places) > 0
    other = SimulatedServices(PlannerConfig(state_dir=tmp_path))  # a planner that was restarted
    listed = other.caller.call(keys.SEARCH_LIST, SearchListRequest()).searches
    assert [(each.search_id, each.state) for each in listed] == [
        (started.search_id, SearchState.CANCELLED)
    ]
    assert other.get(started.search_id) == listed[0]
    other.planner.close()
    services.planner.close()


def test_a_disk_that_stands_still_costs_no_command_and_no_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on, loop = threading.Event(), threading.current_thread()

    def stands_still(_: int) -> None:
        assert threading.current_thread() is not loop
        goes_on.wait()

    monkeypatch.setattr(os, "fsync", stands_still)
    services = SimulatedServices(PlannerConfig(state_dir=tmp_path))
    started = services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    sent: list[VelocityCommand] = []

    def goes_on_sending() -> bool:
        sent.extend(services.sent_commands())
        return len(sent) > 20

    services.until(goes_on_sending)
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    services.until(lambda: bool(last := services.sent_commands()) and not any(map(moves, last)))
    goes_on.set()
    services.planner.close()
    (recorded,) = decision_log.past(tmp_path)
    assert (recorded.search_id, recorded.state) == (started.search_id, SearchState.CANCELLED)


def test_a_folder_that_cannot_be_written_is_said_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("no folder")
    services = SimulatedServices(PlannerConfig(state_dir=tmp_path / "file"))
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.until(lambda: services.get().choice.number > 0)
    services.until(lambda: "cannot record the search" in caplog.text)
    services.frame()
    assert caplog.text.count("cannot record the search") == 1
    services.planner.close()


def test_silence_without_a_search_is_a_problem_after_a_while(services: SimulatedServices) -> None:
    health = services.planner.health()
    assert not health.ready
    assert health.problem == "waiting for the robot's position: none yet"
    assert np.isfinite(list((health.metrics or {}).values())).all()


def test_a_drive_asks_for_no_similarity_and_keeps_the_searched_layer(
    services: SimulatedServices,
) -> None:
    status = services.go_to(3.0, 2.0)
    assert (status.kind, status.place_m, status.objects) == (SearchKind.GO_TO, (3.0, 2.0), ())
    services.until(lambda: any(map(moves, services.sent_commands())))
    assert set(services.asked) == {""}
    assert services.resets == []
    with pytest.raises(RemoteError, match=r"for the place \(3.00, 2.00\) is still active"):
        services.start("sofa")


def test_a_drive_arrives_where_the_robot_stands(services: SimulatedServices) -> None:
    services.go_to(2.0, 2.0)  # the robot is there and, on this bus, never moves
    services.until(lambda: not services.get().active)
    assert services.get().state is SearchState.ARRIVED
    assert services.get().reason == "standing 0.00 m from the place (2.00, 2.00)"
