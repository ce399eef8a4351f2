"""Several robots behind one gateway, which is a real server."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest
from pydantic import SecretStr, ValidationError

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.security import MAX_FAILURES
from onemap_gateway.service import GatewayWorker, build
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import Odometry
from tests.shared.messages.broken import sample

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
def client(worker: GatewayWorker) -> Iterator[httpx.Client]:
    headers = {"authorization": f"Bearer {TOKEN}"}
    address = f"http://127.0.0.1:{worker.port}"
    with httpx.Client(base_url=address, headers=headers, timeout=PATIENCE_S) as client:
        yield client


def test_the_robots_are_listed_with_what_is_connected(client: httpx.Client) -> None:
    robots = client.get("/v1/robots").json()["robots"]
    assert [(each["name"], each["namespace"], each["address"]) for each in robots] == [
        ("r1", "site/r1", "/robots/r1"),
        ("r2", "site/r2", "/robots/r2"),
    ]
    assert [each["services"] for each in robots] == [["mapper"], ["planner"]]
    assert not robots[0]["ready"]
    assert "robot" in robots[0]["problem"]


def test_each_robot_has_its_own_status_and_page(client: httpx.Client) -> None:
    def running(prefix: str) -> list[str]:
        services = client.get(f"{prefix}/v1/status").json()["services"]
        return [each["name"] for each in services if each["alive"]]

    assert running("/robots/r1") == ["mapper"]
    assert running("/robots/r2") == ["planner"]
    assert running("") == ["gateway"]
    assert "OneMap" in client.get("/robots/r1/").text


@pytest.mark.parametrize("path", ["/v1/robots", "/robots/r1/v1/status", "/robots/r9/v1/status"])
def test_every_robot_needs_the_token(client: httpx.Client, path: str) -> None:
    assert client.get(path, headers={"authorization": ""}).status_code == 401


def test_moving_another_robot_needs_the_right_role(worker: GatewayWorker) -> None:
    with httpx.Client(base_url=f"http://127.0.0.1:{worker.port}", timeout=PATIENCE_S) as client:
        answer = client.post("/robots/r1/v1/searches", json={"object": "bed"})
    assert answer.status_code == 401


def test_who_guesses_at_one_robot_is_locked_out_at_all(client: httpx.Client) -> None:
    wrong = {"authorization": "Bearer guess"}
    paths = ["/v1/robots", "/robots/r1/v1/status", "/robots/r2/v1/status"]
    for number in range(MAX_FAILURES):
        assert client.get(paths[number % len(paths)], headers=wrong).status_code == 401
    assert [client.get(path).status_code for path in paths] == [429] * len(paths)


def test_an_unknown_robot_is_not_found(client: httpx.Client) -> None:
    assert client.get("/robots/r9/v1/status").status_code == 404


def test_a_gateway_of_one_robot_lists_none() -> None:
    worker = build(MemoryRouter().bus("gateway"), GatewayConfig(port=0))
    try:
        answer = httpx.get(f"http://127.0.0.1:{worker.port}/v1/robots", timeout=PATIENCE_S)
        assert answer.json() == {"robots": []}
    finally:
        worker.close()


@pytest.mark.parametrize(
    "robots", [{"R 1": "site/r1"}, {"r1": ""}, {"r1": "site/*"}, {"r1": "/r1"}, {"": "site/r1"}]
)
def test_names_that_cannot_be_addressed_are_refused(robots: dict[str, str]) -> None:
    with pytest.raises(ValidationError):
        GatewayConfig(robots=robots)
