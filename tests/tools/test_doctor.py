"""The doctor: what is observed of the bus, each fault that it finds in it, and what it prints."""

from __future__ import annotations

import io
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from onemap.replies import ServiceHealth
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.transport import Counters
from onemap_shared.wire import Packet
from onemap_tools.doctor import (
    BusObserver,
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
    stamp_ns = time.time_ns()
    return m.MapRevision(frames, frames, stamp_ns, "mini-1", "minilm", frames, cells, 10, 20.0, 5.0)


HEALTHY = Observations(
    services=tuple(map(service, ("robot", "perception", "mapper", "planner", "gateway"))),
    streams=(
        ObservedStream("rgbd", "robot", Counters(28), 0.05),
        ObservedStream("odometry", "robot", Counters(70), 0.02),
        ObservedStream("field", "perception", Counters(25), 0.12),
        ObservedStream("revision", "mapper", Counters(25), 0.2),
    ),
    clocks_s={"robot": -0.02, "mapper": -0.01},
    revision=revision(115, 4100),
    commanded=0.4,
    driven=0.4,
)


def with_clock(robot_s: float) -> Observations:
    """Of a robot whose clock is so much ahead."""
    streams = (replace(each, age_s=(each.age_s or 0.0) - robot_s) for each in HEALTHY.streams)
    return replace(HEALTHY, streams=tuple(streams), clocks_s={"robot": robot_s})


def with_stream(name: str = "rgbd", age_s: float | None = 0.05, **counters: Any) -> Observations:
    changed = Counters(**{"received": 28, **counters})
    streams = (
        replace(s, counters=changed, age_s=age_s) if s.name == name else s for s in HEALTHY.streams
    )
    return replace(HEALTHY, streams=tuple(streams))


def with_service(name: str, **changes: Any) -> Observations:
    services = (
        service(name, **changes) if each.name == name else each for each in HEALTHY.services
    )
    return replace(HEALTHY, services=tuple(services))


def changed(**changes: Any) -> Observations:
    return replace(HEALTHY, **changes)


HUNG = "The mapper has not been heard for 8 s: its process hangs or its link is down."
ERRORS = (
    (with_service("planner", condition="down", problem=HUNG, metrics={}), HUNG),
    (with_service("planner", condition="degraded", ready=False, problem="No frames."), "No frames"),
    (with_stream(received=0, age_s=None), "Nothing arrives on rgbd from the robot:"),
    (with_stream(disordered=14), "14 of 28 messages on rgbd"),
    (
        with_stream(received=0, age_s=None, refused=4, last_problem="depth has dtype float32"),
        "4 messages on rgbd could not be read, the last because: depth has dtype float32",
    ),
    (with_stream(age_s=7.27), "rgbd is 7.2 s older than what the robot says now. The robot is too"),
    (changed(revision=revision(20, 0)), "20 frames were fused and the map is still empty"),
    (changed(driven=0.0), "commands motion and the robot stands"),
)
OTHERS = (
    (
        with_service("planner", condition="degraded", problem="Frames are old."),
        Severity.WARNING,
        "Frames are old",
    ),
    (with_clock(-5.0), Severity.NOTE, "differ from this machine's: the robot's by -5.0 s. Nothing"),
    (with_clock(30.0), Severity.NOTE, "the robot's by +30.0 s."),
    (changed(clocks_s={"planner": 4.0}), Severity.NOTE, "the planner's by +4.0 s. Nothing stops"),
    (changed(collided=True), Severity.WARNING, "touches an obstacle"),
)
FAULTS = (*((observed, Severity.ERROR, words) for observed, words in ERRORS), *OTHERS)


@pytest.mark.parametrize(("observed", "severity", "words"), FAULTS, ids=[f[2] for f in FAULTS])
def test_a_fault_is_one_finding(observed: Observations, severity: Severity, words: str) -> None:
    (finding,) = diagnose(observed)
    assert words in finding.sentence
    assert finding.sentence.endswith(".")
    assert finding.severity is severity
    assert healthy([finding]) is (severity is not Severity.ERROR)


@pytest.mark.parametrize(
    "observed",
    [
        HEALTHY,
        with_stream(disordered=2),  # the publisher was started again
        with_stream("revision", disordered=14),  # the mapper announces a map again
        changed(revision=revision(1, 0)),
    ],
)
def test_what_is_no_fault_is_no_finding(observed: Observations) -> None:
    assert diagnose(observed) == []


def test_errors_come_first() -> None:
    slow = with_service("mapper", condition="degraded", problem="Slow.")
    observed = replace(slow, driven=0.0, clocks_s={"robot": 30.0})
    severities = [each.severity for each in diagnose(observed)]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def test_every_topic_is_observed() -> None:
    router = MemoryRouter()
    robot, mapper = router.bus("simulator"), router.bus("mapper")
    observer = BusObserver(router.bus())
    now_ns, depth_mm = time.time_ns(), np.full((10, 10), 2000, np.uint16)
    rgb, camera = np.zeros((10, 10, 3), np.uint8), Intrinsics.from_fov(10, 10, 1.2)
    frame = m.RgbdFrame(1, now_ns, rgb, depth_mm, camera, camera_mount(0.0, 1.0, 0.0))
    robot.publish(keys.ROBOT_RGBD).put(frame)
    observer.poll()
    odometry = m.Odometry(1, now_ns, pose_2d(0, 0, 0), 0.3, -0.1, True)
    robot.publish(keys.ROBOT_ODOMETRY).put(odometry)
    robot.publish(keys.ROBOT_CMD_VEL).put(m.VelocityCommand(1, 1, 0.1, -0.9))
    for each in (revision(3, 100), revision(4, 90), revision(9, 140)):
        mapper.publish(keys.MAP_REVISION).put(each)
    for number, late_s in enumerate((0.4, 0.01)):
        stamp_ns = time.time_ns() - int(late_s * 1e9)
        beat = m.Heartbeat("mapper", "a", stamp_ns, number, ready=True)
        mapper.publish(keys.heartbeat("mapper")).put(beat)
    router.inject(keys.ROBOT_RGBD.key, Packet(b"nonsense", b""))
    observer.poll()
    observed = observer.observations()

    conditions = {each.name: each.condition for each in observed.services}
    assert conditions == {
        **{"robot": "ok", "mapper": "ok", "simulator": "degraded"},  # without a heartbeat
        **dict.fromkeys(("perception", "planner", "gateway"), "down"),
    }
    streams = {stream.name: stream for stream in observed.streams}
    assert streams[keys.ROBOT_RGBD.key].counters.refused == 1
    age_s = streams[keys.ROBOT_ODOMETRY.key].age_s
    assert age_s is not None
    assert 0 <= age_s < 60
    assert observed.clocks_s["robot"] == -age_s
    assert observed.clocks_s["mapper"] == pytest.approx(-0.01, abs=0.3)  # of the younger one
    assert (observed.commanded, observed.driven, observed.collided) == (0.9, 0.3, True)
    assert observed.revision is not None
    assert observed.revision.frames_fused == 9


def test_a_silent_bus_is_observed_for_the_duration() -> None:
    began_s = time.monotonic()
    observed = observe(MemoryRouter().bus(), 0.05)
    assert time.monotonic() - began_s >= 0.05
    assert (observed.revision, observed.commanded) == (None, 0.0)


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
        services = services_of(url, "")
    assert services is not None
    (finding,) = diagnose(Observations(services))
    assert finding == Finding(Severity.ERROR, HUNG)
    assert services_of(url, "") is None  # it ended
