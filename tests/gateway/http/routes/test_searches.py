"""/v1/searches."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager

import httpx
import pytest
from starlette.testclient import TestClient

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import SearchState
from tests.gateway.fakes import WAIT_S, FakePlanner, client_on, search


@contextmanager
def on_socket(router: MemoryRouter) -> Iterator[httpx.Client]:
    """A client of a gateway on a real socket: what is streamed arrives as it is sent."""
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        address = f"http://127.0.0.1:{worker.port}"
        with httpx.Client(base_url=address, timeout=WAIT_S, trust_env=False) as client:
            yield client


def test_a_search_is_created_with_its_address(client: TestClient) -> None:
    answer = client.post("/v1/searches", json={"objects": ["sofa", "kettle"]})
    assert answer.status_code == 201
    assert answer.headers["Location"] == "/v1/searches/s1"
    report = client.get(answer.headers["Location"]).json()
    assert report["objects"] == ["sofa", "kettle"]
    assert report["target"] == "sofa"
    assert report["active"] is True


def test_one_object_may_stand_alone(client: TestClient) -> None:
    report = client.post("/v1/searches", json={"object": " sofa "}).json()
    assert report["objects"] == ["sofa"]


def test_a_second_search_is_refused_with_the_id_of_the_first(client: TestClient) -> None:
    client.post("/v1/searches", json={"object": "sofa"})
    answer = client.post("/v1/searches", json={"object": "kettle"})
    assert answer.status_code == 409
    assert answer.json()["search_id"] == "s1"
    assert "'sofa'" in answer.json()["detail"]
    assert "DELETE /v1/searches/s1" in answer.json()["detail"]


def test_unknown_words_come_back_with_the_nearest_known_ones(client: TestClient) -> None:
    answer = client.post("/v1/searches", json={"objects": ["sofa", "flurb"]})
    assert answer.status_code == 422
    problem = answer.json()
    assert problem["type"].endswith("unknown_word")
    assert problem["status"] == 422  # what a service adds replaces no member of the document
    assert "'flurb' (did you mean 'curb'?)" in problem["detail"]
    assert problem["words"] == [{"word": "flurb", "did_you_mean": ["curb"]}]


def test_after_the_first_has_ended_a_second_may_start(
    client: TestClient, planner: FakePlanner
) -> None:
    client.post("/v1/searches", json={"object": "sofa"})
    planner.move(SearchState.NOT_FOUND)
    assert client.post("/v1/searches", json={"object": "kettle"}).status_code == 201


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"objects": []},
        {"objects": "sofa"},
        {"objects": ["sofa", ""]},
        {"objects": ["sofa", 5]},
        {"objects": ["x" * 10_000]},
        {"objects": ["sofa"] * 21},
        {"object": ""},
        {"object": None},
        {"object": "sofa", "objects": ["sofa"]},
        {"object": "sofa", "speed": 3},
        [],
    ],
)
def test_a_search_for_nothing_sensible_is_refused(
    client: TestClient, planner: FakePlanner, body: object
) -> None:
    answer = client.post("/v1/searches", json=body)
    assert answer.status_code == 422
    assert answer.json()["detail"]
    assert planner.status is None


def test_a_search_can_be_stopped(client: TestClient) -> None:
    client.post("/v1/searches", json={"object": "sofa"})
    report = client.delete("/v1/searches/s1").json()
    assert report["state"] == "cancelled"
    assert report["active"] is False


def test_the_newest_search_needs_no_id(client: TestClient) -> None:
    assert client.get("/v1/searches/current").status_code == 404
    client.post("/v1/searches", json={"object": "sofa"})
    assert client.get("/v1/searches/current").json()["id"] == "s1"
    assert client.delete("/v1/searches/current").json()["state"] == "cancelled"


def test_searches_are_listed_newest_first(client: TestClient, planner: FakePlanner) -> None:
    planner.past = [search("s0", SearchState.FOUND)]
    client.post("/v1/searches", json={"object": "sofa"})
    listed = client.get("/v1/searches").json()
    assert [each["id"] for each in listed["searches"]] == ["s1", "s0"]
    assert listed["searches"][0] == {
        **client.get("/v1/searches/s1").json(),
        "elapsed_s": listed["searches"][0]["elapsed_s"],
    }
    assert listed["left_out"] == 2


@pytest.mark.parametrize("search_id", ["nix", "a b", "..", "%00", "x" * 1000, "ü"])
@pytest.mark.parametrize("suffix", ["", "/events"])
def test_a_search_that_never_was_is_not_found(
    client: TestClient, search_id: str, suffix: str
) -> None:
    answer = client.get(f"/v1/searches/{search_id}{suffix}")
    assert answer.status_code == 404
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_events_of_a_search_that_is_over_end_at_once(
    client: TestClient, planner: FakePlanner
) -> None:
    client.post("/v1/searches", json={"object": "sofa"})
    planner.move(SearchState.FOUND)
    answer = client.get("/v1/searches/s1/events")
    assert answer.headers["Content-Type"].startswith("text/event-stream")
    assert answer.text.count("event: status") == 1
    assert '"state": "found"' in answer.text
    assert "retry: 2000" in answer.text


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
            planner.move(SearchState.FOUND)
            after = list(lines)
    assert (before.count("event: status"), after.count("event: status")) == (1, 1)


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "/v1/searches"),
        ("GET", "/v1/searches"),
        ("GET", "/v1/searches/s1"),
        ("GET", "/v1/searches/current"),
        ("DELETE", "/v1/searches/s1"),
        ("GET", "/v1/searches/s1/events"),
    ],
)
def test_without_a_planner_it_is_named(router: MemoryRouter, method: str, path: str) -> None:
    with client_on(router) as client:
        body = {"object": "sofa"} if method == "POST" else None
        answer = client.request(method, path, json=body)
    assert answer.status_code == 503
    assert answer.json()["service"] == "planner"


@pytest.mark.parametrize("kind", ["go_to", "look_at"])
def test_the_robot_is_sent_to_a_place(client: TestClient, planner: FakePlanner, kind: str) -> None:
    answer = client.post("/v1/searches", json={f"{kind}_m": [1, -2.5]})
    assert answer.status_code == 201
    report = answer.json()
    assert (report["kind"], report["place_m"]) == (kind, [1.0, -2.5])
    assert (report["objects"], report["target"], report["active"]) == ([], "", True)
    planner.move(SearchState.ARRIVED)
    report = client.get("/v1/searches/s1").json()
    assert (report["state"], report["active"]) == ("arrived", False)


def test_a_search_for_objects_has_no_place(client: TestClient) -> None:
    report = client.post("/v1/searches", json={"object": "sofa"}).json()
    assert (report["kind"], report["place_m"]) == ("find", None)


def test_a_drive_is_named_by_its_place_when_another_is_refused(client: TestClient) -> None:
    client.post("/v1/searches", json={"go_to_m": [1, -2.5]})
    answer = client.post("/v1/searches", json={"object": "kettle"})
    assert answer.status_code == 409
    assert "a search for the place (1.00, -2.50)" in answer.json()["detail"]


@pytest.mark.parametrize("place", ["[NaN, 1]", "[1e6, 1]", "[1]", "[]", "null"])
def test_what_is_no_place_is_refused(client: TestClient, planner: FakePlanner, place: str) -> None:
    answer = client.post(
        "/v1/searches",
        content=f'{{"go_to_m": {place}}}',
        headers={"Content-Type": "application/json"},
    )
    assert answer.status_code in (400, 422)
    assert answer.json()["detail"]
    assert planner.status is None
