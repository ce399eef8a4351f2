"""Each check reports its fault, and nothing without it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_tools.doctor.checks import (
    CHECKS,
    Finding,
    Severity,
    check_clocks,
    check_depth,
    check_driving,
    check_encoders,
    check_floor,
    check_map,
    check_services,
    check_streams,
    diagnose,
)
from onemap_tools.doctor.observations import (
    DepthStatistics,
    MapGrowth,
    MotionSummary,
    Observations,
    ProcessHealth,
    StreamStatus,
)
from onemap_tools.doctor.report import document, healthy
from onemap_tools.processes.services import CORE

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


def the_one(findings: list[Finding]) -> Finding:
    (finding,) = findings
    assert finding.sentence.endswith(".")
    assert finding.remedy.endswith(".")
    return finding


def with_stream(stream: StreamStatus) -> Observations:
    others = tuple(other for other in HEALTHY.streams if other.name != stream.name)
    return replace(HEALTHY, streams=(stream, *others))


def with_process(**changes: object) -> Observations:
    ill = replace(HEALTHY.processes[0], **changes)  # type: ignore[arg-type]
    return replace(HEALTHY, processes=(ill, *HEALTHY.processes[1:]))


@pytest.mark.parametrize("role", ["planner", "robot"])
def test_two_processes_of_a_role_are_named(role: str) -> None:
    twice = replace(HEALTHY, doubled={role: (f"{role} a", f"{role} b")})
    again = ProcessHealth("planner", "planner-2", True, "", 0.0, True)
    twice = replace(twice, processes=(*twice.processes, again) if role == "planner" else ())
    finding = the_one(check_services(twice))
    assert f"2 processes are the {role} ({role} a, {role} b)" in finding.sentence
    assert "namespace" in finding.remedy


def test_two_publishers_of_a_stream_are_seen_by_its_numbers() -> None:
    for disordered, expected in ((0, 0), (2, 0), (14, 1)):
        stream = StreamStatus("rgbd", "robot", count=28, age_s=0.05, disordered=disordered)
        assert len(check_streams(with_stream(stream))) == expected
    assert "14 of 28 messages on rgbd" in the_one(check_streams(with_stream(stream))).sentence
    revision = StreamStatus("revision", "mapper", count=28, age_s=0.05, disordered=14)
    assert check_streams(with_stream(revision)) == []


def test_a_healthy_robot_has_no_findings() -> None:
    assert diagnose(HEALTHY) == []


def test_an_empty_bus_is_reported() -> None:
    observed = Observations(duration_s=3.5, streams=(StreamStatus("rgbd", "robot"),))
    sentences = [finding.sentence for finding in diagnose(observed)]
    assert "The mapper is not running." in sentences
    assert "Nothing arrives on rgbd from the robot." in sentences


@pytest.mark.parametrize("name", CORE)
def test_a_missing_service_is_named_with_its_command(name: str) -> None:
    finding = the_one(check_services(replace(HEALTHY, alive=HEALTHY.alive - {name})))
    assert finding.sentence == f"The {name} is not running."
    assert f"onemap {name}" in finding.remedy


def test_a_hanging_service_is_to_be_restarted() -> None:
    gateway = ProcessHealth("gateway", "g", True, "", 0.0, True, {"hung_mapper_s": 8.2})
    observed = replace(HEALTHY, alive=HEALTHY.alive - {"mapper"}, processes=(gateway,))
    finding = the_one(check_services(observed))
    assert finding.sentence.startswith("The mapper has not been heard for 8 s: its process hangs")
    assert finding.remedy.startswith("Restart it rather than start a second one")


def test_a_robot_that_lacks_a_topic_is_sent_to_the_list_of_its_topics() -> None:
    problem = "no node publishes /odom (ros2.topics.odometry): the nearest of its type is /r1/odom"
    adapter = ProcessHealth("ros2", "r", False, problem, 0.0, True)
    observed = replace(HEALTHY, processes=(*HEALTHY.processes, adapter))
    finding = the_one(check_services(observed))
    assert finding.sentence == f"The ros2 is not well: {problem}."
    assert "onemap ros2 topics" in finding.remedy


def test_a_service_that_runs_twice_is_an_error() -> None:
    second = replace(HEALTHY.processes[1], instance="another")
    finding = the_one(check_services(replace(HEALTHY, processes=(*HEALTHY.processes, second))))
    assert finding.sentence.startswith("2 processes say that they are the mapper")


def test_a_main_loop_without_progress_is_an_error() -> None:
    finding = the_one(check_services(with_process(advanced=False)))
    assert "stands still" in finding.sentence


def test_an_unready_service_is_an_error_and_a_problem_a_warning() -> None:
    unready = the_one(check_services(with_process(ready=False, problem="no frames")))
    assert (unready.severity, "no frames" in unready.sentence) == (Severity.ERROR, True)
    degraded = the_one(check_services(with_process(problem="frames are old")))
    assert degraded.severity is Severity.WARNING


def test_a_silent_stream_is_named_with_its_source() -> None:
    finding = the_one(check_streams(with_stream(StreamStatus("rgbd", "robot"))))
    assert finding.sentence == "Nothing arrives on rgbd from the robot."


def test_an_unreadable_stream_has_its_reason() -> None:
    stream = StreamStatus("rgbd", "robot", refused=4, last_problem="depth has dtype float32")
    finding = the_one(check_streams(with_stream(stream)))
    assert finding.sentence.startswith("4 messages on rgbd could not be read")
    assert "float32" in finding.sentence


def test_old_messages_are_reported_with_their_age() -> None:
    finding = the_one(check_streams(with_stream(replace(RGBD, age_s=7.25))))
    assert "7.2 s old" in finding.sentence


@pytest.mark.parametrize(("offset_s", "way"), [(4.0, "ahead of"), (-4.0, "behind")])
def test_a_clock_offset_is_reported_with_its_direction(offset_s: float, way: str) -> None:
    finding = the_one(check_clocks(with_process(clock_offset_s=offset_s)))
    assert f"4.0 s {way}" in finding.sentence


def test_stamps_from_the_future_are_a_clock_problem() -> None:
    finding = the_one(check_clocks(with_stream(replace(RGBD, age_s=-30.0))))
    assert "30.0 s in the future" in finding.sentence


@pytest.mark.parametrize(
    ("depth", "words"),
    [
        (DepthStatistics(0.0, float("nan"), 0.0), "Only 0% of the depth"),
        (DepthStatistics(0.9, 0.003, 0.98), "nearer than 10 cm"),
        (DepthStatistics(0.9, 34.0, 0.0), "34 m, more than any room"),
    ],
)
def test_implausible_depth_is_reported(depth: DepthStatistics, words: str) -> None:
    assert words in the_one(check_depth(replace(HEALTHY, depth=depth))).sentence


def with_floor(metrics: dict[str, float]) -> Observations:
    processes = tuple(
        replace(process, metrics=metrics) if process.service == "mapper" else process
        for process in HEALTHY.processes
    )
    return replace(HEALTHY, processes=processes)


def test_a_floor_that_the_mapper_calls_wrong_points_to_the_extrinsics() -> None:
    wrong = {**FLOOR, "floor_height_m": 0.31, "floor_tilt_deg": 5.2, "floor_wrong": 1.0}
    finding = the_one(check_floor(with_floor(wrong)))
    assert finding.severity is Severity.ERROR
    assert "z = 0.31 m, tilted by 5.2 degrees, from 5 viewpoints" in finding.sentence
    assert "T_map_camera" in finding.remedy


def test_a_floor_height_alone_is_no_finding() -> None:
    assert check_floor(with_floor({**FLOOR, "floor_height_m": 0.4})) == []


def test_an_undecided_floor_is_a_note() -> None:
    observed = with_floor({"floor_viewpoints": 1.0})
    finding = the_one(check_floor(observed))
    assert finding.severity is Severity.NOTE
    assert "cannot tell yet" in finding.sentence
    assert finding.remedy.startswith("Drive or turn the robot")
    assert healthy(diagnose(observed))
    assert document(diagnose(observed))["findings"][0]["severity"] == "note"


def test_without_floor_metrics_there_is_no_finding() -> None:
    assert check_floor(with_floor({})) == []


def test_encoders_that_differ_are_all_named() -> None:
    finding = the_one(check_encoders(replace(HEALTHY, field_encoder=("clip-7", "clip"))))
    assert "'clip-7'" in finding.sentence
    assert "'mini-1'" in finding.sentence


def test_an_empty_map_has_no_encoder_to_differ() -> None:
    empty = MapGrowth((0, 1), (0, 10), encoder_id="", text_space="")
    assert check_encoders(replace(HEALTHY, map=empty)) == []


@pytest.mark.parametrize(
    ("growth", "words", "severity"),
    [
        (((100, 100), (4000, 4000)), "No frame reached the map in 4 s", Severity.ERROR),
        (((0, 20), (0, 0)), "20 frames were fused and the map is still empty", Severity.ERROR),
        (((100, 115), (4000, 4000)), "does not grow", Severity.WARNING),
    ],
)
def test_a_map_that_does_not_grow_is_reported(
    growth: tuple[tuple[int, int], tuple[int, int]], words: str, severity: Severity
) -> None:
    observed = replace(HEALTHY, duration_s=3.6, map=MapGrowth(*growth, *ENCODER))
    finding = the_one(check_map(observed))
    assert words in finding.sentence
    assert finding.severity is severity


def test_a_standing_robot_may_keep_its_map() -> None:
    growth = MapGrowth((100, 115), (4000, 4000), *ENCODER)
    assert check_map(replace(HEALTHY, map=growth, motion=MotionSummary())) == []


def test_a_robot_that_does_not_follow_commands_is_an_error() -> None:
    finding = the_one(check_driving(replace(HEALTHY, motion=MotionSummary(0.4, 0.0))))
    assert "stands still" in finding.sentence


def test_a_collision_is_a_warning() -> None:
    finding = the_one(check_driving(replace(HEALTHY, motion=MotionSummary(0.4, 0.4, True))))
    assert finding.severity is Severity.WARNING


def test_errors_come_first() -> None:
    observed = with_floor({"floor_viewpoints": 0.0})
    slow = replace(observed.processes[0], problem="slow")
    observed = replace(observed, processes=(*observed.processes[1:], slow), alive=frozenset())
    severities = [finding.severity for finding in diagnose(observed)]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def test_every_check_is_in_the_list() -> None:
    names = {check.__name__ for check in CHECKS}
    assert names == {name for name in globals() if name.startswith("check_")}
