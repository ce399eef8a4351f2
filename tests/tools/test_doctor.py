"""The doctor: what is observed of the bus, each fault that it finds in it, and what it prints."""

from __future__ import annotations

import io
import threading
import time
from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console

from onemap.replies import ServiceHealth
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.geometry import pose_2d
from onemap_shared.transport import Counters
from onemap_shared.wire import Packet
from onemap_tools.doctor import (
    Finding,
    Observations,
    ObservedStream,
    Severity,
    describe,
    diagnose,
    document,
    healthy,
    observe,
    services_of,
)
from tests.memory_bus import MemoryRouter
from tests.tools.fake_gateway import fake_gateway


def service(name: str, **changes: Any) -> ServiceHealth:
    fields = {"condition": "ok", "problem": "", "alive": True, "ready": True, **changes}
    return ServiceHealth(name=name, **fields)


def revision(frames: int, cells: int) -> m.MapRevision:
    return m.MapRevision(frames, frames, 1, "mini-1", "minilm", frames, cells, 10, 20.0, 5.0)


HEALTHY = Observations(
    services=tuple(map(service, ("robot", "perception", "mapper", "planner", "gateway"))),
    streams=(
        ObservedStream("rgbd", "robot", Counters(28)),
        ObservedStream("odometry", "robot", Counters(70)),
        ObservedStream("field", "perception", Counters(25)),
        ObservedStream("revision", "mapper", Counters(25)),
    ),
    clocks_s={"robot": -0.02, "mapper": -0.01},
    revision=revision(115, 4100),
)


def with_stream(name: str = "rgbd", **counters: Any) -> Observations:
    changed = Counters(**{"received": 28, **counters})
    streams = (replace(s, counters=changed) if s.name == name else s for s in HEALTHY.streams)
    return replace(HEALTHY, streams=tuple(streams))


def with_service(name: str, **changes: Any) -> Observations:
    services = (
        service(name, **changes) if each.name == name else each for each in HEALTHY.services
    )
    return replace(HEALTHY, services=tuple(services))


def changed(**changes: Any) -> Observations:
    return replace(HEALTHY, **changes)


HUNG = "The mapper has not been heard from for 8 s: its process hangs or its link is down."
ERRORS = (
    (with_service("planner", condition="down", problem=HUNG, metrics={}), HUNG),
    (with_service("planner", condition="degraded", ready=False, problem="No frames."), "No frames"),
    (with_stream(received=0), "Nothing arrives on rgbd from the robot:"),
    (
        with_stream(received=0, refused=4, last_problem="depth has dtype float32"),
        "4 messages on rgbd could not be read, the last because: depth has dtype float32",
    ),
    (changed(revision=revision(20, 0)), "20 frames were fused and the map is still empty"),
)
OTHERS = (
    (
        with_service("planner", condition="degraded", problem="Frames are old."),
        Severity.WARNING,
        "Frames are old",
    ),
    (changed(clocks_s={"robot": -5.0}), Severity.NOTE, "this machine's: the robot's by -5.0 s."),
    (changed(clocks_s={"planner": 4.0}), Severity.NOTE, "the planner's by +4.0 s. Nothing stops"),
)
FAULTS = (*((observed, Severity.ERROR, words) for observed, words in ERRORS), *OTHERS)


@pytest.mark.parametrize(("observed", "severity", "words"), FAULTS, ids=[f[2] for f in FAULTS])
def test_a_fault_is_one_finding(observed: Observations, severity: Severity, words: str) -> None:
    (finding,) = diagnose(observed)
    assert words in finding.sentence
    assert finding.sentence.endswith(".")
    assert finding.severity is severity
    assert healthy([finding]) is (severity is not Severity.ERROR)


def test_what_is_no_fault_is_no_finding() -> None:
    assert diagnose(HEALTHY) == []
    assert diagnose(changed(revision=revision(1, 0))) == []


def test_errors_come_first() -> None:
    hung = with_service("planner", condition="down", problem=HUNG)
    slow = with_service("mapper", condition="degraded", problem="Slow.").services
    observed = replace(hung, services=hung.services + slow, clocks_s={"robot": 30.0})
    severities = [each.severity for each in diagnose(observed)]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def test_what_arrives_and_whose_clock_it_is_of_is_observed() -> None:
    router = MemoryRouter()
    robot, mapper = router.bus("simulator"), router.bus("mapper")

    def send() -> None:
        for number, late_s in enumerate((0.4, 0.01)):
            stamp_ns = time.time_ns() - int(late_s * 1e9)
            beat = m.Heartbeat("mapper", "a", stamp_ns, number, ready=True)
            mapper.publish(keys.heartbeat("mapper")).put(beat)
        stamp_ns = time.time_ns() - 5 * 10**9
        robot.publish(keys.ROBOT_ODOMETRY).put(m.Odometry(1, stamp_ns, pose_2d(0, 0, 0), 0.0, 0.0))
        mapper.publish(keys.MAP_REVISION).put(revision(9, 140))
        router.inject(keys.ROBOT_RGBD.key, Packet(b"nonsense", b""))

    sender = threading.Timer(0.1, send)
    sender.start()
    observed = observe(router.bus(), 0.5)
    sender.join()
    streams = {stream.name: stream for stream in observed.streams}
    assert streams[keys.ROBOT_RGBD.key].counters.refused == 1
    assert streams[keys.ROBOT_ODOMETRY.key].counters.received == 1
    assert observed.revision is not None
    assert observed.clocks_s["mapper"] == pytest.approx(-0.01, abs=0.3)  # of the younger one
    assert observed.clocks_s["robot"] == pytest.approx(-5.0, abs=0.5)


def printed(findings: list[Finding]) -> list[str]:
    console = Console(file=(output := io.StringIO()), width=200)
    describe(findings, console)
    return output.getvalue().splitlines()


def test_each_finding_is_a_line() -> None:
    absent = Finding(Severity.ERROR, "The mapper is not running.")
    touched = Finding(Severity.WARNING, "It touches an obstacle [1].")
    unknown = Finding(Severity.NOTE, "The floor is unknown so far.")
    assert printed([absent, touched]) == [
        "error The mapper is not running.",
        "warning It touches an obstacle [1].",
    ]
    well = "Nothing is wrong that can be seen from here."
    assert printed([]) == [well]
    assert printed([unknown])[1:] == [well]
    assert well not in printed([touched, unknown])
    found = {"severity": "warning", "sentence": touched.sentence}
    assert document([touched]) == {"healthy": True, "findings": [found]}
    assert not document([touched, absent])["healthy"]


def test_the_gateway_says_of_its_services_what_its_status_says() -> None:
    status = {"services": [{"name": "mapper", "condition": "down", "problem": HUNG}]}
    with fake_gateway({("GET", "/v1/status"): (200, status)}) as url:
        services, absent = services_of(url, "")
    assert absent == []
    (finding,) = diagnose(Observations(services))
    assert finding == Finding(Severity.ERROR, HUNG)
    services, (finding,) = services_of(url, "")  # it ended
    assert services == ()
    assert finding.sentence.startswith("No gateway at http://127.0.0.1")
