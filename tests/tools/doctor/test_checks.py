"""Each check finds its trouble and keeps quiet without it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_tools.doctor.checks import (
    CHECKS,
    NEEDED,
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
    DepthLook,
    Driving,
    MapLook,
    Observations,
    Pulse,
    Stream,
)
from onemap_tools.doctor.report import document, healthy

ENCODER = ("mini-1", "minilm")
FLOOR = {
    "floor_viewpoints": 5.0,
    "floor_height_m": 0.01,
    "floor_tilt_deg": 0.4,
    "floor_wrong": 0.0,
}
RGBD = Stream("rgbd", "robot", count=28, age_s=0.05)
HEALTHY = Observations(
    duration_s=3.5,
    alive=frozenset({*NEEDED, "simulator"}),
    streams=(
        RGBD,
        Stream("odometry", "robot", count=70, age_s=0.02),
        Stream("field", "perception", count=25, age_s=0.12),
        Stream("revision", "mapper", count=25, age_s=0.2),
    ),
    pulses=tuple(
        Pulse(name, f"{name}-1", True, "", -0.01, True, FLOOR if name == "mapper" else {})
        for name in NEEDED
    ),
    depth=DepthLook(valid=0.97, median_m=2.4, near=0.0),
    map=MapLook(frames=(100, 115), cells=(4000, 4100), encoder_id="mini-1", text_space="minilm"),
    field_encoder=ENCODER,
    text_encoder=ENCODER,
    driving=Driving(commanded=0.4, driven=0.4),
)


def the_one(findings: list[Finding]) -> Finding:
    (finding,) = findings
    assert finding.sentence.endswith(".")
    assert finding.remedy.endswith(".")
    return finding


def with_stream(stream: Stream) -> Observations:
    others = tuple(other for other in HEALTHY.streams if other.name != stream.name)
    return replace(HEALTHY, streams=(stream, *others))


def with_pulse(**changes: object) -> Observations:
    ill = replace(HEALTHY.pulses[0], **changes)  # type: ignore[arg-type]
    return replace(HEALTHY, pulses=(ill, *HEALTHY.pulses[1:]))


def test_a_healthy_robot_has_no_findings() -> None:
    assert diagnose(HEALTHY) == []


def test_silence_on_an_empty_bus_is_not_a_crash() -> None:
    seen = Observations(duration_s=3.5, streams=(Stream("rgbd", "robot"),))
    sentences = [finding.sentence for finding in diagnose(seen)]
    assert "The mapper is not running." in sentences
    assert "Nothing arrives on rgbd from the robot." in sentences


@pytest.mark.parametrize("name", NEEDED)
def test_a_missing_service_is_named_with_its_command(name: str) -> None:
    finding = the_one(check_services(replace(HEALTHY, alive=HEALTHY.alive - {name})))
    assert finding.sentence == f"The {name} is not running."
    assert f"onemap {name}" in finding.remedy


def test_a_service_that_the_gateway_knows_to_hang_is_not_to_be_started() -> None:
    gateway = Pulse("gateway", "g", True, "", 0.0, True, {"hung_mapper_s": 8.2})
    seen = replace(HEALTHY, alive=HEALTHY.alive - {"mapper"}, pulses=(gateway,))
    finding = the_one(check_services(seen))
    assert finding.sentence.startswith("The mapper has not been heard for 8 s: its process hangs")
    assert finding.remedy.startswith("Restart it rather than start a second one")


def test_two_mappers_are_one_too_many() -> None:
    twin = replace(HEALTHY.pulses[1], instance="another")
    finding = the_one(check_services(replace(HEALTHY, pulses=(*HEALTHY.pulses, twin))))
    assert finding.sentence.startswith("2 processes say that they are the mapper")


def test_a_hanging_service_is_told() -> None:
    finding = the_one(check_services(with_pulse(advanced=False)))
    assert "stands still" in finding.sentence


def test_an_unready_service_is_an_error_and_an_ailing_one_a_warning() -> None:
    unready = the_one(check_services(with_pulse(ready=False, problem="no frames")))
    assert (unready.severity, "no frames" in unready.sentence) == (Severity.ERROR, True)
    ailing = the_one(check_services(with_pulse(problem="frames are old")))
    assert ailing.severity is Severity.WARNING


def test_a_silent_stream_is_named_with_its_source() -> None:
    finding = the_one(check_streams(with_stream(Stream("rgbd", "robot"))))
    assert finding.sentence == "Nothing arrives on rgbd from the robot."


def test_an_unreadable_stream_says_why() -> None:
    stream = Stream("rgbd", "robot", refused=4, last_problem="depth has dtype float32")
    finding = the_one(check_streams(with_stream(stream)))
    assert finding.sentence.startswith("4 messages on rgbd could not be read")
    assert "float32" in finding.sentence


def test_old_content_is_told_with_its_age() -> None:
    finding = the_one(check_streams(with_stream(replace(RGBD, age_s=7.25))))
    assert "7.2 s old" in finding.sentence


@pytest.mark.parametrize(("offset_s", "way"), [(4.0, "ahead of"), (-4.0, "behind")])
def test_a_clock_that_disagrees_is_told_with_its_direction(offset_s: float, way: str) -> None:
    finding = the_one(check_clocks(with_pulse(clock_offset_s=offset_s)))
    assert f"4.0 s {way}" in finding.sentence


def test_stamps_from_the_future_are_a_clock_problem() -> None:
    finding = the_one(check_clocks(with_stream(replace(RGBD, age_s=-30.0))))
    assert "30.0 s in the future" in finding.sentence


@pytest.mark.parametrize(
    ("depth", "words"),
    [
        (DepthLook(0.0, float("nan"), 0.0), "Only 0% of the depth"),
        (DepthLook(0.9, 0.003, 0.98), "nearer than 10 cm"),
        (DepthLook(0.9, 34.0, 0.0), "34 m, more than any room"),
    ],
)
def test_depth_that_cannot_be_is_told(depth: DepthLook, words: str) -> None:
    assert words in the_one(check_depth(replace(HEALTHY, depth=depth))).sentence


def with_floor(metrics: dict[str, float]) -> Observations:
    pulses = tuple(
        replace(pulse, metrics=metrics) if pulse.service == "mapper" else pulse
        for pulse in HEALTHY.pulses
    )
    return replace(HEALTHY, pulses=pulses)


def test_a_floor_that_the_mapper_calls_wrong_points_to_the_extrinsics() -> None:
    wrong = {**FLOOR, "floor_height_m": 0.31, "floor_tilt_deg": 5.2, "floor_wrong": 1.0}
    finding = the_one(check_floor(with_floor(wrong)))
    assert finding.severity is Severity.ERROR
    assert "z = 0.31 m, tilted by 5.2 degrees, from 5 viewpoints" in finding.sentence
    assert "T_map_camera" in finding.remedy


def test_a_height_that_the_mapper_does_not_call_wrong_is_repeated_by_nobody() -> None:
    assert check_floor(with_floor({**FLOOR, "floor_height_m": 0.4})) == []


def test_a_floor_that_nobody_can_tell_is_a_note_and_no_failure() -> None:
    seen = with_floor({"floor_viewpoints": 1.0})
    finding = the_one(check_floor(seen))
    assert finding.severity is Severity.NOTE
    assert "cannot tell yet" in finding.sentence
    assert finding.remedy.startswith("Drive or turn the robot")
    assert healthy(diagnose(seen))
    assert document(diagnose(seen))["findings"][0]["severity"] == "note"


def test_a_mapper_without_frames_says_nothing_of_the_floor() -> None:
    assert check_floor(with_floor({})) == []


def test_encoders_that_differ_are_all_named() -> None:
    finding = the_one(check_encoders(replace(HEALTHY, field_encoder=("clip-7", "clip"))))
    assert "'clip-7'" in finding.sentence
    assert "'mini-1'" in finding.sentence


def test_an_empty_map_has_no_encoder_to_differ() -> None:
    empty = MapLook((0, 1), (0, 10), encoder_id="", text_space="")
    assert check_encoders(replace(HEALTHY, map=empty)) == []


@pytest.mark.parametrize(
    ("look", "words", "severity"),
    [
        (((100, 100), (4000, 4000)), "No frame reached the map in 4 s", Severity.ERROR),
        (((0, 20), (0, 0)), "20 frames were fused and the map is still empty", Severity.ERROR),
        (((100, 115), (4000, 4000)), "does not grow", Severity.WARNING),
    ],
)
def test_a_map_that_does_not_grow_is_told(
    look: tuple[tuple[int, int], tuple[int, int]], words: str, severity: Severity
) -> None:
    seen = replace(HEALTHY, duration_s=3.6, map=MapLook(*look, *ENCODER))
    finding = the_one(check_map(seen))
    assert words in finding.sentence
    assert finding.severity is severity


def test_a_standing_robot_may_keep_its_map() -> None:
    look = MapLook((100, 115), (4000, 4000), *ENCODER)
    assert check_map(replace(HEALTHY, map=look, driving=Driving())) == []


def test_a_robot_that_does_not_obey_is_told() -> None:
    finding = the_one(check_driving(replace(HEALTHY, driving=Driving(0.4, 0.0))))
    assert "stands still" in finding.sentence


def test_a_collision_is_a_warning() -> None:
    finding = the_one(check_driving(replace(HEALTHY, driving=Driving(0.4, 0.4, True))))
    assert finding.severity is Severity.WARNING


def test_errors_come_first() -> None:
    seen = with_floor({"floor_viewpoints": 0.0})
    slow = replace(seen.pulses[0], problem="slow")
    seen = replace(seen, pulses=(*seen.pulses[1:], slow), alive=frozenset())
    severities = [finding.severity for finding in diagnose(seen)]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def test_every_check_is_asked() -> None:
    names = {check.__name__ for check in CHECKS}
    assert names == {name for name in globals() if name.startswith("check_")}
