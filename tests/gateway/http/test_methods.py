"""HEAD answers as GET without a body; OPTIONS says what an address takes."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient

from tests.gateway.fakes import FakeMapper, FakePlanner, kept_object
from tests.gateway.http.test_app import operations

CHANGING = {"content-length", "x-onemap-age"}  # from one request to the next
EVENTS = "/v1/searches/{search_id}/events"


def test_every_get_has_a_head_with_the_same_headers(client: TestClient, mapper: FakeMapper) -> None:
    mapper.objects.append(kept_object())
    client.post("/v1/searches", json={"object": "sofa"})
    client.put("/v1/maps/flat")
    paths = [path for method, path, _ in operations(client) if method == "GET" and path != EVENTS]
    assert len(paths) > 8
    for path in (*paths, "/", "/docs", "/openapi.json", "/static/app.js", "/nix"):
        address = path.format(search_id="s1", name="flat", object_id="3f9a12c4")
        whole, head = client.get(address), client.head(address)
        assert head.status_code == whole.status_code, path
        assert head.content == b"", path
        assert head.headers.keys() == whole.headers.keys(), path
        assert {**head.headers, **dict.fromkeys(CHANGING)} == {
            **whole.headers,
            **dict.fromkeys(CHANGING),
        }, path


def test_the_head_of_an_endless_stream_ends(client: TestClient, planner: FakePlanner) -> None:
    address = EVENTS.format(search_id="s1")
    assert client.head(address).status_code == 404
    client.post("/v1/searches", json={"object": "sofa"})
    head = client.head(address)
    assert head.status_code == 200
    assert head.headers["Content-Type"].startswith("text/event-stream")
    assert planner.status is not None
    assert planner.status.active


@pytest.mark.parametrize(
    ("address", "allowed"),
    [
        ("/healthz", "GET, HEAD, OPTIONS"),
        ("/v1/queries", "POST, OPTIONS"),
        ("/v1/searches/s1", "GET, HEAD, DELETE, OPTIONS"),
        ("/v1/maps/flat", "GET, HEAD, PUT, DELETE, OPTIONS"),
        ("/v1/objects/3f9a12c4", "GET, HEAD, DELETE, OPTIONS"),
        ("/static/app.js", "GET, HEAD, OPTIONS"),
    ],
)
def test_options_names_what_an_address_takes(
    client: TestClient, address: str, allowed: str
) -> None:
    answer = client.options(address, headers={"Origin": "http://evil.example"})
    assert answer.status_code == 204
    assert answer.headers["Allow"] == allowed
    assert not [name for name in answer.headers if name.startswith("access-control")]
    refused = client.request("PATCH", address)
    assert refused.status_code == 405
    assert refused.headers["Allow"] == allowed


def test_nothing_takes_no_method(client: TestClient) -> None:
    for address in ("/nix", "/v1/live", "*"):
        assert client.options(address).status_code == 404
    assert client.head("/v1/queries").status_code == 405


def test_requests_are_counted_by_their_own_method_and_route(client: TestClient) -> None:
    client.head("/healthz")
    client.options("/v1/queries")
    text = client.get("/metrics").text
    assert 'method="HEAD",route="/healthz",status="200"' in text
    assert 'method="OPTIONS"' in text
