"""Searches over HTTP: started, followed, stopped, refused."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

import anyio
import httpx
import pytest
from fastapi.sse import ServerSentEvent
from starlette.testclient import TestClient

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.routes.searches import search_events
from onemap_gateway.service import build
from onemap_shared import messages as m
from tests.gateway.fakes import (
    QUICK,
    WAIT_S,
    FakeMapper,
    FakePlanner,
    client_on,
    find_result,
    gateway_on,
    kept_object,
    next_event,
    past_search,
    search,
)
from tests.memory_bus import MemoryRouter


@contextmanager
def on_socket(router: MemoryRouter) -> Iterator[httpx.Client]:
    """A client of a gateway on a real socket: what is streamed arrives as it is sent."""
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        address = f"http://127.0.0.1:{worker.port}"
        with httpx.Client(base_url=address, timeout=WAIT_S, trust_env=False) as client:
            yield client


def test_a_second_search_is_refused_with_the_id_of_the_first(client: TestClient) -> None:
    client.post("/v1/searches", json={"object": "sofa"})
    answer = client.post("/v1/searches", json={"object": "kettle"})
    assert answer.status_code == 409
    assert answer.json()["search_id"] == "s1"
    assert "'sofa'" in answer.json()["detail"]
    assert "DELETE /v1/searches/s1" in answer.json()["detail"]


def test_what_an_interrupted_search_left_is_asked_for_as_it_was(
    client: TestClient, planner: FakePlanner
) -> None:
    """Two of one name are two: the red chair was found, the blue one was not."""
    kitchen = m.Detail("red", inside=("kitchen",)), m.Detail("blue"), m.NO_DETAIL
    found = m.ObjectResult("chair", m.SearchState.FOUND, "", (), 0.9, 1.0, 2.0, (), (), index=0)
    cut_off = replace(found, outcome=m.SearchState.INTERRUPTED, index=1)
    planner.status = replace(
        search("s1", m.SearchState.INTERRUPTED, ("chair", "chair", "bed")),
        results=(found, cut_off),
        details=kitchen,
        stay_out=("bath",),
        max_time_s=60.0,
        max_distance_m=30.0,
    )
    answer = client.post("/v1/searches/current/again")
    assert answer.status_code == 201
    assert answer.headers["Location"] == "/v1/searches/s2"
    (asked,) = planner.requests
    assert (asked.objects, asked.details) == (("chair", "bed"), kitchen[1:])
    assert asked.stay_out == ("bath",)
    assert (asked.max_time_s, asked.max_distance_m) == (60.0, 30.0)
    planner.status = replace(planner.status, objects=("chair",), details=(), results=(found,))
    assert (
        client.post("/v1/searches/s2/again").json()["title"]
        == "Everything in this search was found"
    )
    place = {"kind": m.SearchKind.LOOK_AT, "place_m": (1.0, 2.0)}
    planner.status = replace(
        search("s3", m.SearchState.INTERRUPTED, ()), kind=m.SearchKind.LOOK_AT, place_m=(1.0, 2.0)
    )
    client.post("/v1/searches/s3/again")
    assert {name: getattr(planner.requests[-1], name) for name in place} == place


@pytest.mark.parametrize("name", ["s1", "current"])
def test_going_on_may_be_asked_for_again_while_it_goes_on(
    client: TestClient, planner: FakePlanner, name: str
) -> None:
    """As after an answer that was lost."""
    planner.status = search("s1", m.SearchState.INTERRUPTED)
    begun = client.post(f"/v1/searches/{name}/again")
    assert (begun.status_code, begun.json()["continues"]) == (201, "s1")
    repeated = client.post(f"/v1/searches/{name}/again")
    assert (repeated.status_code, repeated.json()["id"]) == (200, begun.json()["id"])
    assert len(planner.requests) == 1
    planner.past.append(search("s0", m.SearchState.INTERRUPTED))
    other = client.post("/v1/searches/s0/again")
    assert (other.status_code, other.json()["search_id"]) == (409, begun.json()["id"])


def test_what_somebody_stopped_does_not_begin_again_without_its_own_id(
    client: TestClient, planner: FakePlanner
) -> None:
    planner.status = search("s1", m.SearchState.INTERRUPTED)
    begun = client.post("/v1/searches/s1/again").json()["id"]
    client.delete(f"/v1/searches/{begun}")
    repeated = client.post("/v1/searches/s1/again")
    assert (repeated.status_code, repeated.json()["id"]) == (200, begun)
    assert repeated.json()["state"] == "cancelled"
    assert len(planner.requests) == 1
    assert client.post(f"/v1/searches/{begun}/again").json()["continues"] == begun


BED = replace(kept_object(), where="in the den, next to the desk")


def found_bed(state: m.SearchState = m.SearchState.FOUND) -> m.SearchStatus:
    found = find_result("bed", *BED.position_m[:2])
    return replace(search("s1", state, ("bed",)), results=(found,), elapsed_s=9.0)


def test_a_find_is_told_by_room_and_landmark(
    client: TestClient, planner: FakePlanner, mapper: FakeMapper
) -> None:
    planner.status = found_bed()
    assert client.get("/v1/searches/s1").json()["results"][0]["where"] == ""  # forgotten
    elsewhere = replace(BED, position_m=(9.0, 9.0, 0.4), where="in the attic")
    mapper.objects[:] = [replace(BED, name="sofa", where="in the hall"), elsewhere, BED]
    assert client.get("/v1/objects").json()["objects"][2]["where"] == BED.where
    assert client.get("/v1/searches/s1").json()["results"][0]["where"] == BED.where
    listed = client.get("/v1/searches").json()["searches"]
    assert listed[0]["results"][0]["where"] == BED.where


def test_the_last_event_waits_until_the_mapper_keeps_the_find(
    router: MemoryRouter, planner: FakePlanner, mapper: FakeMapper
) -> None:
    asked: list[int] = []

    class Late(list[m.KeptObject]):
        def __iter__(self) -> Iterator[m.KeptObject]:
            asked.append(1)
            return iter([BED] if len(asked) > 1 else [])

    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        await next_event(events)
        planner.status = found_bed()
        planner.move(m.SearchState.FOUND)
        _, status = await next_event(events)
        assert status["results"][0]["where"] == BED.where
        assert len(asked) == 2

    mapper.objects = Late()
    planner.status = search("s1", objects=("bed",))
    listen(router, scenario)


def test_a_recording_that_is_played_refuses_searches(
    client: TestClient, router: MemoryRouter
) -> None:
    with closing(router.bus("replay")):
        answer = client.post("/v1/searches", json={"object": "sofa"})
        assert answer.status_code == 409
        assert "A recording is played in place of a robot" in answer.json()["detail"]
    assert client.post("/v1/searches", json={"object": "sofa"}).status_code == 201


def test_searches_are_listed_newest_first(client: TestClient, planner: FakePlanner) -> None:
    planner.past = [search("s0", m.SearchState.FOUND)]
    client.post("/v1/searches", json={"object": "sofa"})
    listed = client.get("/v1/searches").json()
    assert [each["id"] for each in listed["searches"]] == ["s1", "s0"]
    assert listed["searches"][0] == {
        **client.get("/v1/searches/s1").json(),
        "elapsed_s": listed["searches"][0]["elapsed_s"],
    }
    assert listed["left_out"] == 2


def test_a_past_search_is_told_step_by_step(client: TestClient, planner: FakePlanner) -> None:
    planner.past = [past_search()]
    replay = client.get("/v1/searches/s0/replay").json()
    assert (replay["search"]["state"], replay["left_out"]) == ("found", 4)
    assert replay["path_m"][5] == [5.0, 0.4, 0.5]
    assert replay["steps"][0] == {
        "elapsed_s": 0.0,
        "state": "exploring",
        "target": "sofa",
        "reason": "looking around for a sofa",
        "robot_m": [-0.6, 0.5],
        "goal_kind": "frontier",
        "goal_m": [1.2, 1.2],
    }
    assert replay["steps"][-1]["goal_m"] is None


@pytest.mark.parametrize("search_id", ["nix", "a b", "..", "%00", "x" * 1000, "ü"])
@pytest.mark.parametrize("suffix", ["", "/events", "/replay"])
def test_a_search_that_never_was_is_not_found(
    client: TestClient, search_id: str, suffix: str
) -> None:
    answer = client.get(f"/v1/searches/{search_id}{suffix}")
    assert answer.status_code == 404
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_a_silent_stream_carries_comments(
    router: MemoryRouter, planner: FakePlanner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search ends after the third comment, however late that comes."""
    monkeypatch.setattr("fastapi.routing._PING_INTERVAL", 0.02)  # seconds; 15 in operation
    before: list[str] = []
    with on_socket(router) as gateway:
        gateway.post("/v1/searches", json={"object": "sofa"})
        with gateway.stream("GET", "/v1/searches/s1/events") as stream:
            lines = stream.iter_lines()
            while before.count(": ping") < 3:
                before.append(next(lines))
            planner.move(m.SearchState.FOUND)
            after = list(lines)
    assert (before.count("event: status"), after.count("event: status")) == (1, 1)


async def is_over(events: AsyncIterator[ServerSentEvent]) -> bool:
    with anyio.fail_after(WAIT_S):
        return [event async for event in events] == []


def listen(
    router: MemoryRouter,
    scenario: Callable[[GatewayContext, AsyncIterator[ServerSentEvent]], Any],
) -> None:
    """Run a scenario on the events of the search ``s1``."""
    with gateway_on(router) as gateway:
        events = search_events(gateway, search("s1"), count=0)
        anyio.run(scenario, gateway, events)


@pytest.mark.parametrize("tick_s", [1, -3600], ids=["as ever", "the planner's clock is set back"])
def test_every_change_is_sent_once_up_to_the_final_state(
    router: MemoryRouter, planner: FakePlanner, tick_s: int
) -> None:
    planner.tick_ns = tick_s * 10**9

    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        name, status = await next_event(events)
        assert (name, status["id"], status["state"]) == ("status", "s1", "exploring")
        for state in (m.SearchState.APPROACHING, m.SearchState.CONFIRMING, m.SearchState.FOUND):
            planner.move(state)
        states = [(await next_event(events))[1]["state"] for _ in range(3)]
        assert states == ["approaching", "confirming", "found"]
        assert await is_over(events)

    planner.status = search("s1")
    listen(router, scenario)


def test_the_stream_outlives_its_planner(router: MemoryRouter) -> None:
    old = FakePlanner(router, search("s1"))

    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        await next_event(events)
        old.bus.close()
        name, problem = await next_event(events)
        assert (name, problem["service"]) == ("problem", "planner")
        new = FakePlanner(
            router, search("s1", m.SearchState.FOUND, updated_ns=search().updated_ns + 9)
        )
        name, status = await next_event(events)
        assert (name, status["state"]) == ("status", "found")
        assert await is_over(events)
        new.bus.close()

    listen(router, scenario)


def test_a_search_that_the_planner_forgot_ends_with_a_problem(
    router: MemoryRouter, planner: FakePlanner
) -> None:
    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        await next_event(events)
        name, problem = await next_event(events)
        assert (name, problem["status"]) == ("problem", 404)
        assert await is_over(events)

    listen(router, scenario)


@pytest.mark.parametrize(
    ("body", "request_made"),
    [
        ({"object": "sofa"}, m.SearchRequest(("sofa",), 2.0)),
        (
            {"objects": ["sofa", "bed"], "max_distance_m": 20, "max_time_s": 90.5},
            m.SearchRequest(("sofa", "bed"), 2.0, max_distance_m=20.0, max_time_s=90.5),
        ),
        (
            {"object": "sofa", "after": "return"},
            m.SearchRequest(("sofa",), 2.0, after=m.After.RETURN),
        ),
        ({"go_to_m": [1, -2.5]}, m.SearchRequest((), 2.0, m.SearchKind.GO_TO, (1.0, -2.5))),
        ({"go_to": "Back"}, m.SearchRequest((), 2.0, m.SearchKind.GO_TO, place="Back")),
        ({"look_at_m": [1, -2.5]}, m.SearchRequest((), 2.0, m.SearchKind.LOOK_AT, (1.0, -2.5))),
    ],
)  # fmt: skip
def test_a_search_is_created_and_stopped_at_its_address(
    client: TestClient, planner: FakePlanner, body: dict[str, object], request_made: m.SearchRequest
) -> None:
    answer = client.post("/v1/searches", json=body)
    assert answer.status_code == 201
    made = [
        replace(each, age_s=0.0, patience_s=request_made.patience_s) for each in planner.requests
    ]
    assert made == [request_made]
    report = client.get(answer.headers["Location"]).json()
    assert (report["objects"], report["active"]) == (list(request_made.objects), True)
    place_m = (0.5, -1.5) if request_made.place else request_made.place_m
    assert report["place_m"] == (list(place_m) or None)
    report = client.delete("/v1/searches/s1").json()
    assert (report["state"], report["active"]) == ("cancelled", False)


def test_what_the_map_answers_too_late_begins_no_search(
    router: MemoryRouter, planner: FakePlanner
) -> None:
    """All calls of a request have one deadline: its client waits no longer."""
    with client_on(router, paces=replace(QUICK, start_s=1e-9)) as client:
        planner.status = search("s1", m.SearchState.INTERRUPTED)
        for path, body in (("", {"object": "sofa"}), ("/s1/again", None)):
            answer = client.post(f"/v1/searches{path}", json=body)
            assert (answer.status_code, planner.requests) == (503, [])
            assert "nothing was started" in answer.json()["detail"]
    with client_on(router, paces=replace(QUICK, start_s=1.0)) as client:
        client.post("/v1/searches", json={"object": "sofa"})
    assert 0.0 < planner.requests[-1].patience_s < 1.0


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({}, "exactly one of"),
        ({"object": "sofa", "objects": ["sofa"]}, "exactly one of"),
        ({"object": "sofa", "go_to_m": [1, 2]}, "exactly one of"),
        ({"go_to_m": [1, 2], "after": "return"}, "'after' is for objects"),
        ({"go_to": "nowhere"}, "no place 'nowhere'"),
        ({"objects": ["sofa", "bed"], "order": "any"}, "'order' is gone: objects are sought as"),
        ({"object": "sofa", "max_time_s": 0}, "max_time_s"),
        ({"object": "sofa", "max_distance_m": "5"}, "max_distance_m"),
        ({"object": "  "}, "empty"),
        ({"object": "x" * (m.MAX_TEXT_CHARS + 1)}, "object"),
        ({"go_to_m": [1]}, "go_to_m"),
        ({"go_to_m": ["1", "2"]}, "go_to_m"),
        ({"look_at_m": [2e5, 0]}, "look_at_m"),
        ({"objects": ["sofa", "flurb"]}, "'flurb' (did you mean 'curb'?)"),
    ],
)
def test_a_search_that_cannot_be_is_refused_with_the_reason(
    client: TestClient, planner: FakePlanner, body: dict[str, object], reason: str
) -> None:
    answer = client.post("/v1/searches", json=body)
    assert answer.status_code == answer.json()["status"] == 422
    assert reason in answer.json()["detail"]
    assert planner.requests == []
