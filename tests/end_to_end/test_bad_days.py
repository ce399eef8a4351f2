"""Services are killed, stopped and cut off during a search; the rest says so and goes on."""

from __future__ import annotations

import time
from typing import Any

import pytest

from onemap_shared import keys
from onemap_shared.messages import TruthRequest
from tests.end_to_end.system import PATIENCE_S, START_S, House

pytestmark = [pytest.mark.slow, pytest.mark.timeout(180)]

BRAKED_S = 5.0  # 0.5 s until the senses count as stale, 0.7 s to brake, 0.5 s seen standing
TOLD_S = 10.0
ANSWERED_S = 4.0  # call_timeout_s and half a second, on a busy machine
RARE = ("guitar", "bicycle", "suitcase", "teddy bear", "washing machine", "piano")


def absent_object(house: House) -> str:
    """Something to look for that is not there: the search goes on through all the tests."""
    bus = house.witness.bus
    there = bus.call(keys.ROBOT_TRUTH, TruthRequest(RARE[0], 0.0, 0.0), 5.0).categories
    return next(name for name in RARE if name not in there)


def searching(house: House) -> str:
    """The id of an active search in which the robot moves."""
    house.mend()
    current = house.http.get("/v1/searches/current")
    if current.status_code == 404 or not current.json()["active"]:
        current = house.http.post("/v1/searches", json={"objects": [absent_object(house)]})
        assert current.status_code == 201, current.text
    house.until(lambda: house.witness.moves, "the robot moves")
    search_id: str = current.json()["id"]
    return search_id


def goes_on(house: House, search_id: str) -> None:
    """The same search is active again, and the robot moves."""
    house.witness.odometry.clear()
    house.until(house.is_ready, "all is well again", START_S)
    house.until(lambda: house.witness.moves, "the robot moves again", START_S)
    search = house.http.get("/v1/searches/current").json()
    assert search["id"] == search_id
    assert search["active"]


def others_live(house: House, gone: str) -> None:
    """Everybody else is connected and sends another heartbeat."""
    others = set(house.services) - {gone}
    before = {name: house.witness.beats[name].progress for name in others}
    house.until(
        lambda: all(house.witness.beats[name].progress > before[name] for name in others),
        f"the others' loops advance without {gone}",
    )
    assert house.witness.alive >= others


def down(house: House) -> set[str]:
    services = house.http.get("/v1/status").json()["services"]
    return {service["name"] for service in services if service["condition"] == "down"}


def refused_in_time(house: House, path: str, body: dict[str, Any]) -> dict[str, Any]:
    """The problem document of a request that cannot be served now."""
    began_s = time.monotonic()
    answer = house.http.post(path, json=body)
    assert time.monotonic() - began_s < ANSWERED_S
    assert answer.status_code == 503, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    return document


REQUESTS = {  # what needs the service; a word nobody asked before, so that no cache helps
    "perception": ("/v1/queries", {"text": "toaster"}),
    "mapper": ("/v1/queries", {"text": "kettle"}),
    "planner": ("/v1/searches", {"object": "kettle"}),
}


@pytest.mark.parametrize("service", REQUESTS)
def test_a_killed_service_is_named_and_the_search_goes_on_when_it_is_back(
    house: House, service: str
) -> None:
    search_id = searching(house)
    house.kill(service)
    house.until(lambda: house.witness.stands, "the robot brakes", BRAKED_S)
    house.until(lambda: house.lacks(service), f"/readyz names {service}", TOLD_S)
    assert service in down(house)
    problem = refused_in_time(house, *REQUESTS[service])
    assert problem["service"] == service
    assert service in problem["detail"].lower()
    others_live(house, service)
    house.start(service)
    goes_on(house, search_id)


def test_a_killed_robot_is_named_and_the_search_goes_on_when_it_is_back(house: House) -> None:
    search_id = searching(house)
    house.kill("simulator")
    house.until(lambda: house.lacks("robot"), "/readyz names the robot", TOLD_S)
    assert {"robot", "simulator"} <= down(house)
    others_live(house, "simulator")
    house.until(
        lambda: "odometry" in house.http.get("/v1/searches/current").json()["reason"],
        "the search says what it waits for",
    )
    house.start("simulator")
    goes_on(house, search_id)


def test_the_robot_needs_no_gateway(house: House) -> None:
    search_id = searching(house)
    house.kill("gateway")
    others_live(house, "gateway")
    house.witness.odometry.clear()
    house.until(lambda: house.witness.moves, "the robot moves on")
    house.start("gateway")
    goes_on(house, search_id)


def test_a_killed_router_stops_the_robot_until_it_is_back(house: House) -> None:
    search_id = searching(house)
    stops = house.witness.beats["simulator"].metrics["deadman_stops"]
    house.kill("router")
    house.until(lambda: not house.is_ready(), "/readyz says that frames do not arrive", TOLD_S)
    refused_in_time(house, *REQUESTS["mapper"])
    assert all(house.processes[name].poll() is None for name in house.services)
    house.start("router")
    house.until(
        lambda: house.witness.beats["simulator"].metrics["deadman_stops"] > stops,
        "the robot braked when nobody steered",
    )
    goes_on(house, search_id)


def test_a_stopped_mapper_skips_frames_and_does_not_queue_them(house: House) -> None:
    search_id = searching(house)
    seen = house.witness.beats["perception"].progress
    house.freeze("mapper")
    house.until(lambda: house.witness.stands, "the robot stops on an old map", BRAKED_S)
    house.until(lambda: house.lacks("mapper"), "/readyz names the mapper", TOLD_S)
    assert revision_age_s(house) > 1.0
    house.until(lambda: house.witness.beats["perception"].progress > seen + 30, "frames go on")
    before = house.witness.revision
    assert before is not None
    house.thaw("mapper")
    house.until(lambda: is_fresh(house, before.revision), "the map is fresh again")
    after = house.witness.revision
    assert after is not None
    fused, passed = after.frames_fused - before.frames_fused, after.sequence - before.sequence
    assert fused < passed / 2  # the frames of the pause were left out
    goes_on(house, search_id)


def told_of(house: House, service: str) -> str:
    """What /v1/status says is wrong with a service."""
    services = house.http.get("/v1/status").json()["services"]
    problem: str = next(each["problem"] for each in services if each["name"] == service)
    return problem


@pytest.mark.parametrize("service", ["mapper", "planner"])
def test_a_hung_service_is_to_be_restarted_and_an_ended_one_to_be_started(
    house: House, service: str
) -> None:
    house.mend()
    # After the router was killed, the gateway must have heard of the service again to miss it.
    house.until(lambda: told_of(house, service) == "", "it is well", TOLD_S)
    house.freeze(service)
    house.until(lambda: "process hangs" in told_of(house, service), "it is missed", TOLD_S)
    house.until(lambda: house.lacks(service), f"/readyz names {service}", TOLD_S)
    refusal = refused_in_time(house, *REQUESTS[service])
    assert (refusal["type"], refusal["service"]) == ("/docs#problem-timeout", service)
    answer = house.ready()
    assert answer is not None
    doctor = house.onemap("doctor")
    assert doctor.returncode == 1
    status = house.onemap("status", "--url", str(house.http.base_url))
    for told in (told_of(house, service), refusal["detail"], answer.json()["detail"]):
        assert told.startswith(f"The {service} has not been heard for ")
        assert told.endswith("restart it rather than start a second one.")
    for output in (doctor.stdout, status.stdout):
        words = " ".join(output.split())
        assert "process hangs or its link" in words
        assert f"The {service} is not running" not in words
        assert f"onemap {service}" not in words
    house.kill(service)
    house.start(service)
    house.until(house.is_ready, "all is well again", START_S)
    house.processes[service].terminate()
    house.until(lambda: f"start it with 'onemap {service}'" in told_of(house, service), "it ended")
    house.processes[service].wait(PATIENCE_S)


def test_the_healthcheck_of_the_containers_tells_who_works(house: House) -> None:
    house.mend()
    assert house.onemap("status", "--service", "mapper").returncode == 0
    house.kill("planner")
    down = house.onemap("status", "--service", "planner")
    assert down.returncode == 1
    assert "planner" in down.stdout + down.stderr


def revision_age_s(house: House) -> float:
    """What the gateway shows as the age of the newest map revision."""
    streams = house.http.get("/v1/status").json()["streams"]
    age_s: float = next(stream["age_s"] for stream in streams if stream["name"] == "revision")
    return age_s


def is_fresh(house: House, since: int) -> bool:
    """Whether a revision after ``since`` shows the world of less than a second ago."""
    newest = house.witness.revision
    return (
        newest is not None
        and newest.revision > since
        and (time.time_ns() - newest.stamp_ns) * 1e-9 < 1.0
    )
