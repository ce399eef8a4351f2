"""The doctor: what is observed of the bus, each fault that it finds in it, and what it prints."""

from __future__ import annotations

import io
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from onemap_shared import keys
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.messages import (
    Heartbeat,
    MapRevision,
    Odometry,
    RgbdFrame,
    TextEmbeddings,
    TextRequest,
    VelocityCommand,
)
from onemap_shared.wire import Packet
from onemap_tools.doctor.checks import (
    DepthStatistics,
    Finding,
    MapGrowth,
    MotionSummary,
    Observations,
    ProcessHealth,
    Severity,
    StreamStatus,
    diagnose,
)
from onemap_tools.doctor.report import (
    BusObserver,
    depth_statistics,
    describe,
    document,
    healthy,
    map_growth,
    observe,
    process_health,
)
from onemap_tools.processes.services import CORE
from tests.memory_bus import MemoryRouter

ENCODER = ("mini-1", "minilm")
FLOOR = {
    "floor_viewpoints": 5.0,
    "floor_height_m": 0.01,
    "floor_tilt_deg": 0.4,
    "floor_wrong": 0.0,
}
RGBD = StreamStatus("rgbd", "robot", count=28, age_s=0.05)
HEALTHY = Observations(
    duration_s=3.5,
    alive=frozenset({*CORE, "simulator"}),
    streams=(
        RGBD,
        StreamStatus("odometry", "robot", count=70, age_s=0.02),
        StreamStatus("field", "perception", count=25, age_s=0.12),
        StreamStatus("revision", "mapper", count=25, age_s=0.2),
    ),
    processes=tuple(
        ProcessHealth(name, f"{name}-1", True, "", -0.01, True, FLOOR if name == "mapper" else {})
        for name in CORE
    ),
    depth=DepthStatistics(valid=0.97, median_m=2.4, near=0.0),
    map=MapGrowth(frames=(100, 115), cells=(4000, 4100), encoder_id="mini-1", text_space="minilm"),
    field_encoder=ENCODER,
    text_encoder=ENCODER,
    motion=MotionSummary(commanded=0.4, driven=0.4),
)


def with_stream(name: str = "rgbd", **changes: Any) -> Observations:
    streams = [replace(s, **changes) if s.name == name else s for s in HEALTHY.streams]
    return replace(HEALTHY, streams=tuple(streams))


def with_process(name: str = CORE[0], **changes: Any) -> Observations:
    processes = [replace(p, **changes) if p.service == name else p for p in HEALTHY.processes]
    return replace(HEALTHY, processes=tuple(processes))


def with_growth(frames: tuple[int, int], cells: tuple[int, int], **changes: Any) -> Observations:
    return replace(HEALTHY, map=MapGrowth(frames, cells, *ENCODER), **changes)


HUNG = ProcessHealth("gateway", "g", True, "", 0.0, True, {"hung_mapper_s": 8.2})
LACKS = "no node publishes /odom (ros2.topics.odometry): the nearest of its type is /r1/odom"
ADAPTER = ProcessHealth("ros2", "r", False, LACKS, 0.0, True)
SECOND = replace(HEALTHY.processes[1], instance="another")
WRONG_FLOOR = {**FLOOR, "floor_height_m": 0.31, "floor_tilt_deg": 5.2, "floor_wrong": 1.0}
TWO = {role: (f"{role} a", f"{role} b") for role in ("planner", "robot")}
ERROR, WARNING, NOTE = Severity.ERROR, Severity.WARNING, Severity.NOTE

# What is observed, how severe it is, and words of the one finding and its remedy.
FAULTS: tuple[tuple[Observations, Severity, str], ...] = (
    *(
        (
            replace(HEALTHY, alive=HEALTHY.alive - {n}),
            ERROR,
            f"{n} is not running. Start it: onemap {n}",
        )
        for n in CORE
    ),
    *(
        (
            replace(HEALTHY, doubled={role: names}),
            ERROR,
            f"2 processes are the {role} ({role} a, {role} b)",
        )
        for role, names in TWO.items()
    ),
    (
        replace(HEALTHY, alive=HEALTHY.alive - {"mapper"}, processes=(HUNG,)),
        ERROR,
        "mapper has not been heard for 8 s: its process hangs or its link is down. Restart",
    ),
    (
        replace(HEALTHY, processes=(*HEALTHY.processes, ADAPTER)),
        ERROR,
        f"The ros2 is not well: {LACKS}. See what the robot has: onemap ros2 topics",
    ),
    (
        replace(HEALTHY, processes=(*HEALTHY.processes, SECOND)),
        ERROR,
        "2 processes say that they are the mapper",
    ),
    (with_process(advanced=False), ERROR, "main loop stands still"),
    (with_process(ready=False, problem="no frames"), ERROR, "no frames"),
    (with_process(problem="frames are old"), WARNING, "frames are old"),
    (with_stream(count=0, age_s=None), ERROR, "Nothing arrives on rgbd from the robot."),
    (with_stream(disordered=14), ERROR, "14 of 28 messages on rgbd"),
    (
        with_stream(count=0, age_s=None, refused=4, last_problem="depth has dtype float32"),
        ERROR,
        "4 messages on rgbd could not be read, the last because: depth has dtype float32",
    ),
    (with_stream(age_s=7.25), ERROR, "7.2 s old"),
    (with_stream(age_s=-30.0), ERROR, "30.0 s in the future"),
    (with_process(clock_offset_s=4.0), ERROR, "4.0 s ahead of"),
    (with_process(clock_offset_s=-4.0), ERROR, "4.0 s behind"),
    (
        replace(HEALTHY, depth=DepthStatistics(0.0, float("nan"), 0.0)),
        ERROR,
        "Only 0% of the depth",
    ),
    (replace(HEALTHY, depth=DepthStatistics(0.9, 0.003, 0.98)), ERROR, "nearer than 10 cm"),
    (replace(HEALTHY, depth=DepthStatistics(0.9, 34.0, 0.0)), ERROR, "34 m, more than any room"),
    (
        with_process("mapper", metrics=WRONG_FLOOR),
        ERROR,
        "z = 0.31 m, tilted by 5.2 degrees, from 5 viewpoints. Check T_map_camera",
    ),
    (
        with_process("mapper", metrics={"floor_viewpoints": 1.0}),
        NOTE,
        "cannot tell yet whether the floor lies at z = 0, from 1 viewpoints. Drive or turn",
    ),
    (
        replace(HEALTHY, field_encoder=("clip-7", "clip")),
        ERROR,
        "camera features from 'clip-7', the map from 'mini-1'",
    ),
    (
        with_growth((100, 100), (4000, 4000), duration_s=3.6),
        ERROR,
        "No frame reached the map in 4 s",
    ),
    (with_growth((0, 20), (0, 0)), ERROR, "20 frames were fused and the map is still empty"),
    (with_growth((100, 115), (4000, 4000)), WARNING, "does not grow"),
    (
        replace(HEALTHY, motion=MotionSummary(0.4, 0.0)),
        ERROR,
        "commands motion and the robot stands",
    ),
    (replace(HEALTHY, motion=MotionSummary(0.4, 0.4, True)), WARNING, "touches an obstacle"),
)


@pytest.mark.parametrize(
    ("observed", "severity", "words"), FAULTS, ids=lambda value: str(value)[:40]
)
def test_a_fault_is_one_finding_with_a_remedy(
    observed: Observations, severity: Severity, words: str
) -> None:
    (finding,) = diagnose(observed)
    assert words in f"{finding.sentence} {finding.remedy}"
    assert finding.sentence.endswith(".")
    assert finding.remedy.endswith(".")
    assert finding.severity is severity
    assert healthy([finding]) is (severity is not ERROR)


@pytest.mark.parametrize(
    "observed",
    [
        HEALTHY,
        with_stream(disordered=2),  # the publisher was started again
        with_stream("revision", disordered=14),  # the mapper announces a map again
        with_process("mapper", metrics={**FLOOR, "floor_height_m": 0.4}),
        with_process("mapper", metrics={}),
        replace(HEALTHY, map=MapGrowth((0, 1), (0, 10), encoder_id="", text_space="")),
        with_growth((100, 115), (4000, 4000), motion=MotionSummary()),  # it stands
    ],
)
def test_what_is_no_fault_is_no_finding(observed: Observations) -> None:
    assert diagnose(observed) == []


def test_errors_come_first() -> None:
    observed = with_process("mapper", metrics={"floor_viewpoints": 0.0})
    slow = replace(observed.processes[0], problem="slow")
    observed = replace(observed, processes=(*observed.processes[1:], slow), alive=frozenset())
    severities = [finding.severity for finding in diagnose(observed)]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def frame(depth_mm: np.ndarray) -> RgbdFrame:
    height, width = depth_mm.shape
    return RgbdFrame(
        sequence=1,
        stamp_ns=time.time_ns(),
        rgb=np.zeros((height, width, 3), np.uint8),
        depth_mm=depth_mm.astype(np.uint16),
        intrinsics=Intrinsics.from_fov(width, height, 1.2),
        T_map_camera=camera_mount(0.0, 1.0, 0.0),
    )


def beat(instance: str, progress: int, stamp_ns: int = 0) -> Heartbeat:
    return Heartbeat("mapper", instance, stamp_ns or time.time_ns(), progress, True)


def revision(frames: int, cells: int) -> MapRevision:
    return MapRevision(
        frames, frames, time.time_ns(), "mini-1", "minilm", frames, cells, 10, 20.0, 5.0
    )


@pytest.mark.parametrize(
    ("depth_mm", "valid", "median_m", "near"),
    [(1000, 1.0, 1.0, 0.0), (3, 1.0, 0.003, 1.0), (0, 0.0, np.nan, 0.0)],
)
def test_depth_statistics_are_of_the_returns(
    depth_mm: int, valid: float, median_m: float, near: float
) -> None:
    statistics = depth_statistics(frame(np.full((20, 30), depth_mm)))
    assert (statistics.valid, statistics.near) == (valid, near)
    assert statistics.median_m == pytest.approx(median_m, nan_ok=True)


def test_process_health_takes_the_newest_beat_and_the_largest_offset() -> None:
    process = process_health([(beat("a", 5), -0.4), (beat("a", 5), -0.01)])
    assert process.clock_offset_s == -0.01
    assert not process.advanced
    assert process_health([(beat("a", 5), 0.0), (beat("a", 6), 0.0)]).advanced
    assert process_health([(beat("a", 5), 0.0)]).advanced  # nothing to compare with


def test_map_growth_is_between_first_and_last_revision() -> None:
    growth = map_growth([revision(3, 100), revision(4, 90), revision(9, 140)])
    assert growth is not None
    assert (growth.frames, growth.cells) == ((3, 9), (100, 140))
    assert map_growth([]) is None


def test_every_topic_is_observed() -> None:
    router = MemoryRouter()
    robot, mapper = router.bus("simulator"), router.bus("mapper")
    observer = BusObserver(router.bus())

    def embed(request: TextRequest) -> TextEmbeddings:
        row = np.ones((1, 2), np.float32)
        mask = np.zeros((1, 0), np.uint8)
        return TextEmbeddings("mini-1", "minilm", request.texts, row, row[:0], mask, 1.0)

    router.bus().serve(keys.EMBED_TEXT, embed)
    robot.publish(keys.ROBOT_RGBD).put(frame(np.full((20, 30), 2000)))
    odometry = Odometry(1, time.time_ns(), pose_2d(0, 0, 0), 0.3, -0.1, True)
    robot.publish(keys.ROBOT_ODOMETRY).put(odometry)
    robot.publish(keys.ROBOT_CMD_VEL).put(VelocityCommand(1, 1, 0.1, -0.9))
    mapper.publish(keys.MAP_REVISION).put(revision(3, 100))
    for instance in ("a", "b"):
        mapper.publish(keys.heartbeat("mapper")).put(beat(instance, 1))
    router.inject(keys.ROBOT_RGBD.key, Packet(b"nonsense", b""))
    observer.poll()
    observed = observer.observations(1.0)

    assert observed.alive == {"simulator", "mapper"}
    assert observed.doubled == {}
    second = router.bus("simulator")
    assert set(observer.observations(1.0).doubled) == {"robot"}
    second.close()
    assert observed.depth is None  # only the newest frame is kept, and it cannot be decoded
    refused = {stream.name: stream.refused for stream in observed.streams}
    assert refused[keys.ROBOT_RGBD.key] == 1
    assert {process.instance for process in observed.processes} == {"a", "b"}
    assert (observed.motion.commanded, observed.motion.driven) == (0.9, 0.3)
    assert observed.motion.collided
    assert observed.text_encoder == ("mini-1", "minilm")
    assert observed.field_encoder is None


def test_no_perception_means_no_text_encoder() -> None:
    assert BusObserver(MemoryRouter().bus()).observations(0.0).text_encoder is None


def test_the_bus_is_observed_for_the_duration() -> None:
    router = MemoryRouter()
    mapper = router.bus("mapper")
    publisher = mapper.publish(keys.MAP_REVISION)
    publisher.put(revision(3, 100))
    began_s = time.monotonic()
    observed = observe(router.bus(), 0.05)
    assert time.monotonic() - began_s >= 0.05
    assert observed.duration_s == 0.05
    assert observed.map is not None
    assert observed.map.frames == (3, 3)


def printed(findings: list[Finding]) -> list[str]:
    console = Console(file=io.StringIO(), width=200)
    describe(findings, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue().splitlines()


def test_each_finding_is_a_line_with_its_remedy() -> None:
    absent = Finding(ERROR, "The mapper is not running.", "Start it: onemap mapper.")
    touched = Finding(WARNING, "The robot touches an obstacle [1].", "Let it back off.")
    unknown = Finding(NOTE, "The floor is unknown so far.", "Drive or turn the robot.")
    assert printed([absent, touched]) == [
        "error The mapper is not running. Start it: onemap mapper.",
        "warning The robot touches an obstacle [1]. Let it back off.",
    ]
    well = "Nothing is wrong that can be seen from here."
    assert printed([]) == [well]
    assert printed([unknown])[1:] == [well]
    assert well not in printed([touched, unknown])
    found = {"severity": "warning", "sentence": touched.sentence, "remedy": touched.remedy}
    assert document([touched]) == {"healthy": True, "findings": [found]}
    assert not document([touched, absent])["healthy"]
