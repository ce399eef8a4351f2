"""A running system: malformed input is refused with its reason, and a mapper that hangs stops the
robot."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pytest
import zenoh

from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.wire import Packet, encode
from tests.end_to_end.malformed import FAULTS, oversized_body, publish, raw_session, sample
from tests.end_to_end.system import System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


RESEND_NS = 2_500_000_000  # two heartbeats: by then a refused message is counted


@dataclass(frozen=True)
class RefusalCounter:
    """A topic that a service subscribes to, and the metric that counts its refused messages."""

    service: str
    topic: Topic[Any]
    metric: str


REFUSAL_COUNTERS = (
    RefusalCounter("perception", keys.ROBOT_RGBD, "frames_refused"),
    RefusalCounter("perception", keys.SEARCH_STATE, "searches_refused"),
    RefusalCounter("mapper", keys.FIELD, "frames_refused"),
    RefusalCounter("planner", keys.ROBOT_ODOMETRY, "odometry_refused"),
    RefusalCounter("planner", keys.MAP_REVISION, "revision_refused"),
    RefusalCounter("planner", keys.DETECTIONS, "detections_refused"),
    RefusalCounter("simulator", keys.ROBOT_CMD_VEL, "commands_refused"),
    RefusalCounter("gateway", keys.ROBOT_RGBD, "rgbd_refused"),
    RefusalCounter("gateway", keys.ROBOT_ODOMETRY, "odometry_refused"),
    RefusalCounter("gateway", keys.DETECTIONS, "detections_refused"),
    RefusalCounter("gateway", keys.MAP_REVISION, "revision_refused"),
    RefusalCounter("gateway", keys.SEARCH_STATE, "search_refused"),
    RefusalCounter("gateway", keys.SEARCH_PATH, "path_refused"),
    RefusalCounter("gateway", keys.heartbeat("mapper"), "heartbeat_refused"),
)


@pytest.fixture(scope="module")
def raw_publisher(system: System) -> Iterator[zenoh.Session]:
    with raw_session(system.endpoint) as session:
        yield session


def refused(system: System, counter: RefusalCounter) -> float:
    """Messages that the service has refused so far, by its last heartbeat."""
    return system.monitor.beats[counter.service].metrics.get(counter.metric, 0.0)


def send_until_refused(
    system: System, raw_publisher: zenoh.Session, packets: Mapping[RefusalCounter, Packet]
) -> None:
    """Send until each counter has increased; again where a valid message replaced ours."""
    before = {counter: refused(system, counter) for counter in packets}
    sent_ns = dict.fromkeys(packets, 0)

    def silent() -> list[RefusalCounter]:
        return [counter for counter in packets if refused(system, counter) <= before[counter]]

    def all_counted() -> bool:
        now_ns = time.time_ns()
        due = [counter for counter in silent() if now_ns - sent_ns[counter] > RESEND_NS]
        for key, packet in {counter.topic.key: packets[counter] for counter in due}.items():
            publish(raw_publisher, key, packet)
        sent_ns.update(dict.fromkeys(due, now_ns))
        return not silent()

    try:
        system.until(all_counted, "every counter has increased")
    except AssertionError as failure:
        names = [f"{counter.service} {counter.metric}" for counter in silent()]
        raise AssertionError(f"not counted: {', '.join(names)}\n{failure}") from None


@pytest.mark.parametrize("fault", FAULTS)
def test_malformed_messages_are_refused_and_counted(
    system: System, raw_publisher: zenoh.Session, fault: str
) -> None:
    packets = {
        counter: FAULTS[fault](encode(sample(counter.topic.message)))
        for counter in REFUSAL_COUNTERS
    }
    broken = {counter: packet for counter, packet in packets.items() if packet is not None}
    assert broken
    send_until_refused(system, raw_publisher, broken)
    assert all(process.poll() is None for process in system.processes.values())


def test_an_oversized_frame_is_refused(system: System, raw_publisher: zenoh.Session) -> None:
    counters = [counter for counter in REFUSAL_COUNTERS if counter.topic is keys.ROBOT_RGBD]
    packet = oversized_body(encode(sample(keys.ROBOT_RGBD.message)))
    send_until_refused(system, raw_publisher, dict.fromkeys(counters, packet))


def test_afterwards_frames_still_reach_the_map(system: System) -> None:
    before = system.monitor.revision
    assert before is not None
    system.until(
        lambda: system.monitor.revision.frames_fused > before.frames_fused + 2,  # type: ignore[union-attr]
        "frames are fused",
    )
    system.until(system.is_ready, "the system is ready")


UNTRAINED = "skateboard"  # in the embedding table, far from all trained classes


def test_a_search_with_an_unknown_word_is_refused_and_nothing_drives(system: System) -> None:
    commands = system.monitor.bus.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
    before = system.monitor.search
    answer = system.http.post("/v1/searches", json={"objects": ["sofa", UNTRAINED]})
    assert answer.status_code == 422, answer.text
    problem = answer.json()
    assert problem["type"].endswith("unknown_word")
    assert problem["words"] == [{"word": UNTRAINED, "did_you_mean": []}]
    assert problem["detail"].startswith(f"{UNTRAINED!r} is like nothing")
    system.until(system.is_ready, "the system is ready")
    for asked in (
        system.http.post("/v1/queries", json={"text": UNTRAINED}),
        system.http.get("/v1/map.png", params={"text": UNTRAINED}),
    ):
        assert (asked.status_code, asked.json()["detail"]) == (422, problem["detail"])
    for _ in range(2):  # heartbeats: commands are sent at 20 Hz
        progress = system.monitor.beats["planner"].progress
        system.until(
            lambda progress=progress: system.monitor.beats["planner"].progress > progress,  # type: ignore[misc]
            "the planner makes progress",
        )
    sent = iter(lambda: commands.take(0.0), None)
    assert not [c for c in sent if c is not None and (c.linear_mps or c.angular_radps)]
    assert system.monitor.stands
    assert system.monitor.search is before


def test_a_query_without_a_match_is_a_sentence(system: System) -> None:
    system.until(system.is_ready, "the system is ready")
    answer = system.http.post("/v1/queries", json={"text": "piano"})
    assert answer.status_code == 200, answer.text
    reply = answer.json()
    assert reply["regions"] == []
    assert reply["message"].startswith("Nothing on the map looks like 'piano': the best")
    found = system.http.post("/v1/queries", json={"text": "wall"}).json()
    assert found["regions"]
    assert found["message"] == ""


PLACE_M = [5.4, 4.0]  # in the hallway of the apartment of seed 1, 3.5 m from the start
DRIVE_S = 120.0  # on shared cores, with waits for the map


def views(system: System, kind: str) -> float:
    beat = system.monitor.beats.get("planner")
    return 0.0 if beat is None else beat.metrics[f"views_{kind}"]


def test_a_drive_stops_while_the_mapper_hangs_and_arrives_after_it(system: System) -> None:
    started = system.http.post("/v1/searches", json={"go_to_m": PLACE_M})
    assert started.status_code == 201
    address = started.headers["Location"]
    system.until(lambda: system.monitor.moves, "the robot moves", DRIVE_S)
    system.until(lambda: views(system, "changed") > 0, "views are asked for as what changed")
    whole = views(system, "whole")
    seen = system.monitor.beats["perception"].progress
    system.suspend("mapper")
    system.until(lambda: system.monitor.stands, "the robot stops without a map")
    before = system.monitor.revision
    assert before is not None
    report = system.http.get(address).json()
    assert (report["kind"], report["active"]) == ("go_to", True)
    assert report["reason"].startswith("waiting for ")
    system.until(lambda: system.lacks("mapper"), "/readyz names the mapper")
    assert revision_age_s(system) > 1.0
    system.until(lambda: system.monitor.beats["perception"].progress > seen + 20, "frames go on")
    resumed_ns = time.time_ns()
    system.resume("mapper")
    system.until(lambda: shows_what_was_after(system, resumed_ns), "the map is fresh again")
    after = system.monitor.revision
    assert after is not None
    fused, passed = after.frames_fused - before.frames_fused, after.sequence - before.sequence
    assert fused < passed / 2  # the frames of the pause were skipped
    system.until(lambda: not system.http.get(address).json()["active"], "it arrives", DRIVE_S)
    report = system.http.get(address).json()
    assert (report["state"], report["place_m"]) == ("arrived", PLACE_M), report["reason"]
    (result,) = report["results"]
    x_m, y_m = result["end_xy_m"]
    assert abs(x_m - PLACE_M[0]) + abs(y_m - PLACE_M[1]) < 0.4
    assert (result["name"], result["outcome"]) == ("", "arrived")
    # Replies that the hanging mapper did not send cost no whole view.
    assert views(system, "whole") == whole > 0
    assert views(system, "changed") > 20


def revision_age_s(system: System) -> float:
    """The age of the newest map revision in /v1/status."""
    streams = system.http.get("/v1/status").json()["streams"]
    age_s: float = next(stream["age_s"] for stream in streams if stream["name"] == "revision")
    return age_s


def shows_what_was_after(system: System, stamp_ns: int) -> bool:
    """Whether the map holds a frame of after ``stamp_ns``."""
    newest = system.monitor.revision
    return newest is not None and newest.stamp_ns > stamp_ns
