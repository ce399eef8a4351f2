"""What strangers send, over the bus and over HTTP: refused with the reason, and survived."""

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
from tests.end_to_end.malformed import WAYS, foreigner, oversized_body, publish, sample
from tests.end_to_end.system import House

pytestmark = [pytest.mark.slow, pytest.mark.timeout(120)]


RESEND_NS = 2_500_000_000  # two heartbeats: a count that was to come would have come


@dataclass(frozen=True)
class Ear:
    """A stream that a service listens to, and the metric that counts what it refuses there."""

    service: str
    topic: Topic[Any]
    metric: str


EARS = (
    Ear("perception", keys.ROBOT_RGBD, "frames_refused"),
    Ear("perception", keys.SEARCH_STATE, "searches_refused"),
    Ear("mapper", keys.FIELD, "frames_refused"),
    Ear("planner", keys.ROBOT_ODOMETRY, "odometry_refused"),
    Ear("planner", keys.MAP_REVISION, "revision_refused"),
    Ear("planner", keys.DETECTIONS, "detections_refused"),
    Ear("simulator", keys.ROBOT_CMD_VEL, "commands_refused"),
    Ear("gateway", keys.ROBOT_RGBD, "rgbd_refused"),
    Ear("gateway", keys.ROBOT_ODOMETRY, "odometry_refused"),
    Ear("gateway", keys.DETECTIONS, "detections_refused"),
    Ear("gateway", keys.MAP_REVISION, "revision_refused"),
    Ear("gateway", keys.SEARCH_STATE, "search_refused"),
    Ear("gateway", keys.SEARCH_PATH, "path_refused"),
    Ear("gateway", keys.heartbeat("mapper"), "heartbeat_refused"),
)


@pytest.fixture(scope="module")
def stranger(house: House) -> Iterator[zenoh.Session]:
    with foreigner(house.endpoint) as session:
        yield session


def refused(house: House, ear: Ear) -> float:
    """How many messages a service has refused there so far, by its last heartbeat."""
    return house.witness.beats[ear.service].metrics.get(ear.metric, 0.0)


def send_until_refused(
    house: House, stranger: zenoh.Session, packets: Mapping[Ear, Packet]
) -> None:
    """Send to all until each has counted one; again where a valid message took its place."""
    before = {ear: refused(house, ear) for ear in packets}
    sent_ns = dict.fromkeys(packets, 0)

    def deaf() -> list[Ear]:
        return [ear for ear in packets if refused(house, ear) <= before[ear]]

    def heard() -> bool:
        now_ns = time.time_ns()
        due = [ear for ear in deaf() if now_ns - sent_ns[ear] > RESEND_NS]
        for key, packet in {ear.topic.key: packets[ear] for ear in due}.items():
            publish(stranger, key, packet)
        sent_ns.update(dict.fromkeys(due, now_ns))
        return not deaf()

    try:
        house.until(heard, "everybody counts what it refuses")
    except AssertionError as failure:
        names = [f"{ear.service} {ear.metric}" for ear in deaf()]
        raise AssertionError(f"not counted: {', '.join(names)}\n{failure}") from None


@pytest.mark.parametrize("way", WAYS)
def test_broken_messages_are_refused_counted_and_survived(
    house: House, stranger: zenoh.Session, way: str
) -> None:
    packets = {ear: WAYS[way](encode(sample(ear.topic.message))) for ear in EARS}
    broken = {ear: packet for ear, packet in packets.items() if packet is not None}
    assert broken
    send_until_refused(house, stranger, broken)
    assert all(process.poll() is None for process in house.processes.values())


def test_a_frame_larger_than_any_is_refused(house: House, stranger: zenoh.Session) -> None:
    ears = [ear for ear in EARS if ear.topic is keys.ROBOT_RGBD]
    packet = oversized_body(encode(sample(keys.ROBOT_RGBD.message)))
    send_until_refused(house, stranger, dict.fromkeys(ears, packet))


def test_afterwards_frames_still_reach_the_map(house: House) -> None:
    before = house.witness.revision
    assert before is not None
    house.until(
        lambda: house.witness.revision.frames_fused > before.frames_fused + 2,  # type: ignore[union-attr]
        "frames are fused",
    )
    house.until(house.is_ready, "all is well")


TEXTS: dict[str, Any] = {
    "empty": "",
    "blank": " \t\n",
    "an essay": "sofa " * 2000,
    "control characters": "\x00\x01\x02",
    "digits only": "12345",
    "a number": 7,
    "a list": ["sofa"],
    "nothing": None,
}


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize(("path", "name"), [("/v1/queries", "text"), ("/v1/searches", "object")])
def test_text_that_is_none_is_refused_over_http(
    house: House, path: str, name: str, text: str
) -> None:
    answer = house.http.post(path, json={name: TEXTS[text]})
    assert 400 <= answer.status_code < 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["detail"].endswith(".")
    assert len(answer.content) < 2000  # the essay is not sent back


def test_bytes_that_are_no_text_are_refused_over_http(house: House) -> None:
    headers = {"content-type": "application/json"}
    answer = house.http.post("/v1/queries", content=b'{"text": "\xff\xfe"}', headers=headers)
    assert answer.status_code == 400
    assert answer.headers["content-type"] == "application/problem+json"


NO_PLACE = "skateboard"  # ships in the table, and is near nothing that mini was trained to see


def test_a_search_with_a_word_without_a_place_is_refused_and_nothing_drives(house: House) -> None:
    commands = house.witness.bus.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
    before = house.witness.search
    answer = house.http.post("/v1/searches", json={"objects": ["sofa", NO_PLACE]})
    assert answer.status_code == 422, answer.text
    problem = answer.json()
    assert problem["type"].endswith("unknown_word")
    [unknown] = problem["words"]
    assert unknown["word"] == NO_PLACE
    assert unknown["did_you_mean"]
    assert f"{NO_PLACE!r} (did you mean {unknown['did_you_mean'][0]!r}" in problem["detail"]
    for _ in range(2):  # heartbeats: commands go out twenty times a second
        progress = house.witness.beats["planner"].progress
        house.until(
            lambda progress=progress: house.witness.beats["planner"].progress > progress,  # type: ignore[misc]
            "the planner goes on",
        )
    sent = iter(lambda: commands.take(0.0), None)
    assert not [c for c in sent if c is not None and (c.linear_mps or c.angular_radps)]
    assert house.witness.stands
    assert house.witness.search is before


def test_a_query_for_what_is_not_there_is_no_place_but_a_sentence(house: House) -> None:
    house.until(house.is_ready, "all is well")
    answer = house.http.post("/v1/queries", json={"text": NO_PLACE})
    assert answer.status_code == 200, answer.text
    reply = answer.json()
    assert reply["regions"] == []
    assert reply["message"].startswith(f"Nothing on the map looks like {NO_PLACE!r}: the best")
    assert reply["did_you_mean"]
    found = house.http.post("/v1/queries", json={"text": "wall"}).json()
    assert found["regions"]
    assert found["message"] == ""


def test_a_second_search_is_refused_with_the_id_of_the_first(house: House) -> None:
    first = house.http.post("/v1/searches", json={"objects": ["sofa"]})
    assert first.status_code == 201, first.text
    second = house.http.post("/v1/searches", json={"objects": ["bed"]})
    assert second.status_code == 409
    assert second.headers["content-type"] == "application/problem+json"
    assert second.json()["search_id"] == first.json()["id"]
    cancelled = house.http.delete(f"/v1/searches/{first.json()['id']}")
    assert cancelled.json()["state"] == "cancelled"
    third = house.http.post("/v1/searches", json={"objects": ["bed"]})
    assert third.status_code == 201
    house.http.delete(f"/v1/searches/{third.json()['id']}")
