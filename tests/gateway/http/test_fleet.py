from __future__ import annotations

from collections.abc import Callable

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.testclient import TestClient
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from onemap_gateway.http.middleware import FleetApp, split


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
def client() -> TestClient:
    return TestClient(FleetApp(application("own"), {"r1": application("r1")}))


@pytest.mark.parametrize(
    ("path", "answer"),
    [
        ("/v1/status", "own /v1/status"),
        ("/", "own /"),
        ("/robots/r1/v1/status", "r1 /v1/status"),
        ("/robots/r1/", "r1 /"),
        ("/robots/r1", "r1 /"),
        ("/robots/r2/v1/status", "own /robots/r2/v1/status"),
        ("/robots/r1x/v1/status", "own /robots/r1x/v1/status"),
        ("/robots/", "own /robots/"),
        ("/robots//v1/status", "own /robots//v1/status"),
    ],
)
def test_the_path_chooses_the_robot(client: TestClient, path: str, answer: str) -> None:
    assert client.get(path).text == answer


def test_addresses_of_new_things_have_the_robots_prefix(client: TestClient) -> None:
    assert client.get("/robots/r1/v1/searches").headers["location"] == "/robots/r1/v1/x"
    assert client.get("/v1/searches").headers["location"] == "/v1/x"


@pytest.mark.parametrize(("prefix", "name"), [("", "own"), ("/robots/r1", "r1")])
def test_sockets_are_of_the_robot_too(client: TestClient, prefix: str, name: str) -> None:
    with client.websocket_connect(f"{prefix}/v1/live") as socket:
        assert socket.receive_text() == f"{name} /v1/live"


def test_what_follows_a_name_is_never_empty() -> None:
    parse: Callable[[str], tuple[str, str]] = split
    assert parse("/robots/r1") == ("r1", "/")
    assert parse("/robots/r1//x") == ("r1", "//x")
    assert parse("/v1/robots") == ("", "/v1/robots")
