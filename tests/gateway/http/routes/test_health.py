"""/healthz, /readyz, /v1/status and /metrics."""

from __future__ import annotations

from starlette.testclient import TestClient

from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway import fakes
from tests.gateway.fakes import client_of, gateway_on, state_reached


def test_the_process_lives_whatever_else_is_missing(router: MemoryRouter) -> None:
    with gateway_on(router) as gateway:
        answer = client_of(gateway).get("/healthz")
    assert answer.json() == {"status": "ok"}


def test_the_robot_is_not_ready_until_a_frame_reached_the_map(router: MemoryRouter) -> None:
    buses = {name: router.bus(name) for name in ("simulator", "perception", "mapper", "planner")}
    with gateway_on(router) as gateway:
        client = client_of(gateway)
        answer = client.get("/readyz")
        assert answer.status_code == 503
        assert answer.json()["service"] == "robot"
        for name, bus in buses.items():
            bus.publish(keys.heartbeat(name)).put(fakes.heartbeat(name))
        revisions = buses["mapper"].publish(keys.MAP_REVISION)
        revisions.put(fakes.revision(1))
        assert state_reached(
            gateway.cache, lambda s: s.revision is not None and len(s.heartbeats) == 4
        )
        assert client.get("/readyz").status_code == 503
        revisions.put(fakes.revision(2))
        assert state_reached(gateway.cache, lambda s: s.last_fused_s is not None)
        assert client.get("/readyz").status_code == 200
        buses["planner"].close()
        assert state_reached(gateway.cache, lambda s: "planner" not in s.alive)
        answer = client.get("/readyz")
        assert answer.status_code == 503
        assert answer.json()["service"] == "planner"


def test_the_status_names_every_service_and_stream(client: TestClient) -> None:
    status = client.get("/v1/status").json()
    assert status["ready"] is False
    names = [service["name"] for service in status["services"]]
    assert names[:4] == ["robot", "perception", "mapper", "planner"]
    missing = {s["name"] for s in status["services"] if s["condition"] == "down"}
    assert missing == {"robot", "perception"}
    assert {stream["name"] for stream in status["streams"]} >= {"rgbd", "odometry", "revision"}
    assert isinstance(status["latencies"], list)


def test_metrics_count_requests_by_route(client: TestClient) -> None:
    client.get("/v1/searches/nix")
    client.request("BREW", "/v1/searches/coffee")
    text = client.get("/metrics").text
    assert (
        'onemap_http_requests_total{method="GET",route="/v1/searches/{search_id}",status="404"} 1.0'
        in text
    )
    assert 'method="other"' in text
    assert 'onemap_up{service="mapper"}' in text
