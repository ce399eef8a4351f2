"""Health, live state and metrics of a robot, and several robots behind one gateway."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest
from pydantic import SecretStr
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.testclient import TestClient
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.middleware import FleetApp
from onemap_gateway.service import GatewayWorker, build
from onemap_shared import keys
from onemap_shared.messages import Odometry
from tests.gateway.fakes import WAIT_S, gateway_on, odometry, state_reached
from tests.memory_bus import MemoryRouter
from tests.shared.samples import sample


def test_ages_are_of_the_robot_s_clock_whatever_the_gateway_s_says(
    router: MemoryRouter,
) -> None:
    with gateway_on(router) as gateway:
        now = odometry(0.0, 0.0)  # of a clock that stands months behind
        router.bus().publish(keys.ROBOT_ODOMETRY).put(now)
        assert state_reached(gateway.cache, lambda state: state.odometry is not None)
        told_ns = gateway.now_ns() - now.stamp_ns
        assert 0 <= told_ns < WAIT_S * 1e9


def test_metrics_count_requests_by_route(client: TestClient) -> None:
    client.get("/v1/searches/nix")
    client.request("BREW", "/v1/searches/coffee")
    client.get("/healthz")
    text = client.get("/metrics").text
    assert 'method="GET",route="/healthz",status="200"' in text
    assert (
        'onemap_http_requests_total{method="GET",route="/v1/searches/{search_id}",status="404"} 1.0'
        in text
    )
    assert 'method="other"' in text
    assert 'onemap_up{service="mapper"}' in text


TOKEN = "secret"
PATIENCE_S = 90.0  # several applications start in one process
ROBOTS = {"r1": "site/r1", "r2": "site/r2"}


@pytest.fixture
def worker() -> Iterator[GatewayWorker]:
    router = MemoryRouter()
    bus = router.bus("gateway")
    for number, namespace in enumerate(ROBOTS.values()):
        bus.sibling(namespace).close()  # makes the namespace
        robot = router.namespaces[namespace].bus("planner" if number else "mapper")
        robot.publish(keys.ROBOT_ODOMETRY).put(sample(Odometry))
    config = GatewayConfig(port=0, robots=ROBOTS, token=SecretStr(TOKEN))
    worker = build(bus, config)
    yield worker
    worker.close()


@pytest.fixture
def fleet(worker: GatewayWorker) -> Iterator[httpx.Client]:
    headers = {"authorization": f"Bearer {TOKEN}"}
    address = f"http://127.0.0.1:{worker.port}"
    with httpx.Client(base_url=address, headers=headers, timeout=PATIENCE_S) as fleet:
        yield fleet


def test_the_robots_are_listed_with_what_is_connected(fleet: httpx.Client) -> None:
    robots = fleet.get("/v1/robots").json()["robots"]
    assert [(each["name"], each["namespace"], each["address"]) for each in robots] == [
        ("r1", "site/r1", "/robots/r1"),
        ("r2", "site/r2", "/robots/r2"),
    ]
    assert [each["services"] for each in robots] == [["mapper"], ["planner"]]
    assert not robots[0]["ready"]
    assert "robot" in robots[0]["problem"]


def test_each_robot_has_its_own_status_and_page(fleet: httpx.Client) -> None:
    def running(prefix: str) -> list[str]:
        services = fleet.get(f"{prefix}/v1/status").json()["services"]
        return [each["name"] for each in services if each["alive"]]

    assert running("/robots/r1") == ["mapper"]
    assert running("/robots/r2") == ["planner"]
    assert running("") == ["gateway"]
    assert "OneMap" in fleet.get("/robots/r1/").text


def application(name: str) -> ASGIApp:
    """Answers with its name and the path that it sees."""

    async def show(request: Request) -> Response:
        return PlainTextResponse(f"{name} {request.url.path}", headers={"location": "/v1/x"})

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await socket.send_text(f"{name} {socket.url.path}")
        await socket.close()

    return Starlette(routes=[WebSocketRoute("/v1/live", live), Route("/{rest:path}", show)])


@pytest.fixture
def routed() -> TestClient:
    return TestClient(FleetApp(application("own"), {"r1": application("r1")}))


def test_new_things_and_sockets_are_of_the_robot_too(routed: TestClient) -> None:
    for prefix, name in (("", "own"), ("/robots/r1", "r1")):
        answer = routed.get(f"{prefix}/v1/searches")
        assert answer.text == f"{name} /v1/searches"
        assert answer.headers["location"] == f"{prefix}/v1/x"
        with routed.websocket_connect(f"{prefix}/v1/live") as socket:
            assert socket.receive_text() == f"{name} /v1/live"
