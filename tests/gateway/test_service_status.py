"""Conditions of services that are well, slow, hung or gone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present import service_status
from onemap_shared.messages import Heartbeat
from onemap_shared.supervisor import LAUNCHED_VARIABLE
from tests.gateway import fakes
from tests.gateway.fakes import members

SERVICES = ("simulator", "perception", "mapper", "planner")
MEMBERS = members(*SERVICES)


def well(now_s: float) -> LiveState:
    """A robot of which all is well at ``now_s``."""
    state = LiveState().with_members(MEMBERS, 0.0)
    for service in SERVICES:
        state = state.with_message(fakes.heartbeat(service), now_s)
    state = state.with_message(fakes.rgbd(), now_s)
    state = state.with_message(fakes.odometry(0, 0), now_s)
    state = state.with_message(fakes.revision(1), now_s)
    return state.with_message(fakes.revision(2), now_s)


def test_nothing_is_wrong_when_all_is_well() -> None:
    state = well(10.0)
    assert service_status.find_pipeline_fault(state, 10.0, 5.0) is None
    assert [report.name for report in service_status.assess_services(state, 10.0)] == [
        *service_status.PIPELINE_STAGES,
        "simulator",
    ]
    for report in service_status.assess_services(state, 10.0):
        assert report.condition == service_status.OK
        assert report.problem == ""


@pytest.mark.parametrize("service", ["perception", "mapper", "planner"])
def test_a_killed_service_is_named_at_once_with_the_command_that_starts_it(service: str) -> None:
    state = well(10.0).with_members(MEMBERS - members(service), 10.5)
    report = service_status.assess_service(service, state, 11.0)
    assert (report.condition, report.ready) == (service_status.DOWN, False)
    assert f"onemap service {service}" in report.problem
    fault = service_status.find_pipeline_fault(state, 11.0, 5.0)
    assert fault is not None
    assert fault.service == service


def test_a_robot_that_ended_or_fell_silent_is_not_ready() -> None:
    ended = well(10.0).with_members(MEMBERS - members("simulator"), 10.3)
    fault = service_status.find_pipeline_fault(ended, 10.3, 5.0)
    assert fault is not None
    assert fault.service == "robot"
    assert fault.detail.startswith("The simulator stopped 0 s ago: start it with 'onemap service")
    fault = service_status.find_pipeline_fault(well(10.0), 12.1, 5.0)
    assert fault is not None
    assert fault.detail.startswith("No camera frame for 2 s")
    begun = ended.with_members(MEMBERS, 10.8)  # another one, of which no frame has come yet
    fault = service_status.find_pipeline_fault(begun, 10.9, 5.0)
    assert fault is not None
    assert fault.detail == "The simulator is starting."
    seen = begun.with_message(fakes.rgbd(2), 11.2)
    assert service_status.find_pipeline_fault(seen, 11.2, 5.0) is None
    other = ended.with_message(fakes.rgbd(2), 10.5)  # of a robot without a token
    assert service_status.find_pipeline_fault(other, 10.5, 5.0) is None


def test_what_a_live_driver_says_of_the_robot_is_the_reason() -> None:
    said = replace(fakes.heartbeat("ros2"), ready=False, problem="no message arrives on /odom")
    there = members(*SERVICES[1:], "ros2")
    state = well(10.0).with_members(there, 10.0).with_message(said, 11.0)
    for now_s in (11.0, 13.0):  # frames are fresh, then not
        fault = service_status.find_pipeline_fault(state, now_s, 5.0)
        assert fault is not None
        assert (fault.service, fault.detail) == ("robot", "No message arrives on /odom.")


@pytest.mark.parametrize(
    ("beat", "said"),
    [
        ({"problem": "no text encoder", "ready": False}, "No text encoder."),
        ({"ready": False}, "The planner is not ready and does not say why."),
        ({"version": "9.9"}, "The planner runs version 9.9, the gateway "),
    ],
)
def test_what_a_heartbeat_tells_is_passed_on(beat: dict[str, Any], said: str) -> None:
    message = replace(fakes.heartbeat("planner", 2), **beat)
    report = service_status.assess_service("planner", well(10.0).with_message(message, 10.0), 10.0)
    assert report.condition == service_status.DEGRADED
    assert report.problem.startswith(said)


@pytest.mark.parametrize(
    ("role", "second"), [("mapper", ("mapper", "2")), ("robot", ("robot", "my-robot"))]
)
def test_two_processes_of_one_role_are_said_and_nothing_is_ready(
    role: str, second: tuple[str, str]
) -> None:
    state = well(10.0).with_members(MEMBERS, 10.0)
    assert service_status.find_pipeline_fault(state, 10.0, 5.0) is None
    state = state.with_members(MEMBERS | {second}, 10.0)
    fault = service_status.find_pipeline_fault(state, 10.0, 5.0)
    assert fault is not None
    assert fault.service == role
    assert fault.detail.startswith(f"2 processes run as the {role} (")
    assert fault.detail.endswith("): their messages mix; stop all but one of them.")
    (report,) = (each for each in service_status.assess_services(state, 10.0) if each.name == role)
    assert (report.condition, report.problem) == (service_status.DEGRADED, fault.detail)


def test_a_lost_router_is_named_and_nobody_else_is_blamed() -> None:
    state = well(10.0).with_members(frozenset(), 10.0, connected=False)
    fault = service_status.find_pipeline_fault(state, 10.0, 5.0)
    assert fault is not None
    assert fault.service == "router"
    assert "lost the router: start it with 'onemap service router' and the same" in fault.detail
    assert {each.problem for each in service_status.assess_services(state, 10.0)} == {fault.detail}


def test_a_start_that_goes_well_says_starting_and_blames_nobody(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(LAUNCHED_VARIABLE, " ".join(SERVICES))
    state, said = LiveState(since_s=0.0), []

    def look(now_s: float) -> None:
        fault = service_status.find_pipeline_fault(state, now_s, 5.0)
        said.append(fault.detail if fault else "")

    look(0.1)  # nobody has joined the bus
    state = state.with_members(members("simulator"), 1.0)
    look(1.0)
    state = state.with_members(MEMBERS, 2.0)
    begins = Heartbeat(
        "simulator", "i1", 1, 1, False, "it is starting, for 1 s so far", {"start_s": 1}
    )
    state = state.with_message(begins, 2.0)
    look(2.0)
    for service in SERVICES:
        state = state.with_message(fakes.heartbeat(service), 4.0)
    state = state.with_message(fakes.rgbd(), 4.0).with_message(fakes.odometry(0, 0), 4.0)
    look(5.0)
    state = state.with_message(fakes.revision(1), 5.5).with_message(fakes.revision(2), 5.5)
    look(5.5)
    assert said == [
        "The simulator is starting.",
        "The simulator is starting.",
        "The simulator is starting, for 1 s so far.",
        "The map is starting: the first frame is on its way to it.",
        "",
    ]


def test_a_start_that_does_not_come_to_its_end_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LAUNCHED_VARIABLE, " ".join(SERVICES))
    state = LiveState(since_s=0.0).with_members(MEMBERS - members("mapper"), 1.0)
    report = service_status.assess_service("mapper", state, 20.0)
    assert (report.condition, report.problem) == ("degraded", "The mapper is starting.")
    report = service_status.assess_service("mapper", state, 31.0)
    assert report.condition == "down"
    assert report.problem.startswith("The mapper is not running: it is started again by itself")
    (robot, *_) = service_status.assess_services(state, 32.0)
    assert robot.problem.startswith("No camera frame has arrived yet: check the robot")


def test_frames_that_get_lost_without_a_culprit_are_said_so() -> None:
    state = well(10.0)
    now_s = 30.0
    for service in SERVICES:
        state = state.with_message(fakes.heartbeat(service, 2), now_s)
    state = state.with_message(fakes.rgbd(), now_s).with_message(fakes.odometry(0, 0), now_s)
    fault = service_status.find_pipeline_fault(state, now_s, 5.0)
    assert fault is not None
    assert fault.service == "mapper"
    assert "onemap doctor" in fault.detail


def test_a_service_that_falls_silent_hangs_and_must_not_be_started_twice() -> None:
    report = service_status.assess_service("mapper", well(10.0), 14.0)
    assert report.condition == service_status.DOWN
    assert report.problem == (
        "The mapper has not been heard from for 4 s: its process hangs or its link is down; "
        "restart it rather than start a second one."
    )


@pytest.mark.parametrize("lost_after_s", [2.0, 3.3])
def test_a_token_that_outlives_the_heartbeat_is_of_a_process_that_hangs(
    lost_after_s: float,
) -> None:
    state = well(10.0).with_members(MEMBERS - members("mapper"), 10.0 + lost_after_s)
    report = service_status.assess_service("mapper", state, 18.0)
    assert report.condition == service_status.DOWN
    assert report.problem.startswith(
        "The mapper has not been heard from for 8 s: its process hangs"
    )
    assert report.problem == service_status.hung_problem("mapper", state, 18.0)
    fault = service_status.find_pipeline_fault(state.with_message(fakes.rgbd(), 18.0), 18.0, 5.0)
    assert fault is not None
    assert "start it" not in fault.detail


def test_a_restarted_service_without_heartbeat_neither_hangs_nor_is_down() -> None:
    state = well(10.0).with_members(MEMBERS - members("mapper"), 12.5).with_members(MEMBERS, 20.0)
    report = service_status.assess_service("mapper", state, 21.0)
    assert (report.condition, report.problem) == (
        service_status.DEGRADED,
        "The mapper is starting.",
    )
    state = state.with_message(fakes.heartbeat("mapper", 5), 21.5)
    assert service_status.assess_service("mapper", state, 22.0).condition == service_status.OK


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("it is starting, for 7 s so far", "The mapper is starting, for 7 s so far."),
        ("compiling: 3 of about 35 s", "Compiling: 3 of about 35 s."),
    ],
)
def test_a_service_that_starts_is_waited_for_while_an_import_silences_it(
    said: str, shown: str
) -> None:
    beat = Heartbeat("mapper", "m2", 1, 1, False, said, {"start_s": 7.0})
    state = well(10.0).with_members(MEMBERS - members("mapper"), 10.5)
    state = state.with_members(MEMBERS, 12.0).with_message(beat, 12.0)
    for now_s in (12.1, 20.0, 40.0):
        report = service_status.assess_service("mapper", state, now_s)
        assert (report.condition, report.problem) == (service_status.DEGRADED, shown)
    assert "process hangs" in service_status.hung_problem("mapper", state, 43.0)


def test_a_service_that_starts_answers_nothing_though_frames_still_arrive() -> None:
    assert service_status.find_pipeline_fault(well(10.0), 10.1, 5.0) is None
    beat = Heartbeat("planner", "p2", 1, 1, False, "it is starting, for 0 s so far", {"start_s": 0})
    fault = service_status.find_pipeline_fault(well(10.0).with_message(beat, 10.1), 10.1, 5.0)
    assert fault is not None
    assert (fault.service, fault.detail) == ("planner", "The planner is starting, for 0 s so far.")


def test_a_hung_loop_is_down_though_it_still_beats() -> None:
    state = well(10.0).with_message(fakes.heartbeat("mapper", 1), 17.0)
    report = service_status.assess_service("mapper", state, 17.0)
    assert report.condition == service_status.DOWN
    assert "stood still for 7 s" in report.problem


def test_a_robot_without_odometry_is_degraded() -> None:
    state = LiveState().with_message(fakes.rgbd(), 1.0)
    robot = service_status.assess_services(state, 1.0)[0]
    assert robot.condition == service_status.DEGRADED
    assert "odometry" in robot.problem


def test_visitors_of_the_bus_are_not_services() -> None:
    state = LiveState().with_members(members("doctor", "demo", "perception"), 0.0)
    assert [report.name for report in service_status.assess_services(state, 10.0)] == list(
        service_status.PIPELINE_STAGES
    )
