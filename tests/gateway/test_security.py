"""Hosts, origins, roles, tokens, and the bodies that are read."""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Iterator
from typing import Any

import anyio
import pytest
from starlette.testclient import TestClient
from starlette.types import Message, Receive, Scope, Send
from starlette.websockets import WebSocketDisconnect

from onemap_gateway.config import GatewayConfig, Role
from onemap_gateway.http import security
from tests.gateway.fakes import FakeMapper, FakePlanner, client_on
from tests.memory_bus import MemoryRouter

JSON = {"Content-Type": "application/json"}


@pytest.mark.parametrize(
    "host",
    ["localhost", "LOCALHOST:8080", "127.0.0.1:8080", "[::1]:8080", "192.168.1.7"],
)
def test_addresses_and_localhost_are_served(client: TestClient, host: str) -> None:
    assert client.get("/healthz", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("host", ["e.example:80", "127.0.0.1.e.example", "", "["])
def test_a_rebound_name_is_not(client: TestClient, host: str) -> None:
    for path in ("/healthz", "/docs", "/static/swagger-ui/swagger-ui.css"):
        assert client.get(path, headers={"Host": host}).status_code == 421
    answer = client.get("/", headers={"Host": host})
    assert "allowed_hosts" in answer.json()["detail"]


def test_a_configured_name_is_served(router: MemoryRouter) -> None:
    with client_on(router, GatewayConfig(allowed_hosts=("robot.local",))) as client:
        assert client.get("/healthz", headers={"Host": "robot.local:8080"}).status_code == 200
        page = {"Host": "robot.local", "Origin": "https://robot.local"}
        assert client.post("/v1/map/clear", headers=page).status_code == 503


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost:9999", "http://["]
)
def test_a_foreign_page_may_not_change_anything(client: TestClient, origin: str) -> None:
    for method, path in (
        ("POST", "/v1/map/clear"),
        ("DELETE", "/v1/searches/s1"),
        ("PUT", "/v1/maps/flat"),
        ("DELETE", "/v1/maps/flat"),
    ):
        answer = client.request(method, path, headers={"Origin": origin})
        assert answer.status_code == 403
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect("ws://localhost:8080/v1/live", headers={"Origin": origin}),
    ):
        pass


TOKENS = {"token": "aD-min.1", "search_token": "se:arch=", "look_token": "0123"}
LOCKED = GatewayConfig.model_validate(TOKENS)


@pytest.fixture
def locked(router: MemoryRouter, mapper: FakeMapper, planner: FakePlanner) -> Iterator[TestClient]:
    with client_on(router, LOCKED) as client:
        yield client


def bearing(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


@pytest.mark.parametrize("given", [None, "Bearer", "Bearer 012", "Basic 0123", "0123"])
def test_what_is_no_token_is_refused(locked: TestClient, given: str | None) -> None:
    headers = {} if given is None else {"Authorization": given}
    answer = locked.get("/v1/map", headers=headers)
    assert answer.status_code == 401
    assert answer.headers["WWW-Authenticate"] == "Bearer"
    assert "gateway.token" in answer.json()["detail"]


def test_without_a_token_only_the_page_and_the_checks_are_public(locked: TestClient) -> None:
    """Every route that the interface documents, and the page with all that it loads."""
    public = {"/healthz", "/readyz"}
    for path, methods in locked.get("/openapi.json").json()["paths"].items():
        for method in methods:
            address = path.format(search_id="s1", name="flat", object_id="3f9a12c4")
            status = locked.request(method, address).status_code
            assert (status != 401) == (path in public), path
    for path in ("/", "/docs", "/static/app.js", "/static/swagger-ui/swagger-ui.css"):
        assert locked.get(path).status_code == 200
    assert locked.get("/static/../v1/map").status_code in (401, 404)


@pytest.mark.parametrize(
    ("role", "path", "allowed"),
    [
        ("look_token", "GET /v1/map", True),
        ("look_token", "HEAD /v1/map", True),
        ("look_token", "POST /v1/map.png", True),
        ("look_token", "POST /v1/searches", False),
        ("look_token", "DELETE /v1/searches/s1", False),
        ("search_token", "GET /v1/map", True),
        ("search_token", "POST /v1/searches", True),
        ("search_token", "DELETE /v1/searches/s1", True),
        ("search_token", "POST /v1/map/clear", False),
        ("search_token", "DELETE /v1/objects/o1", False),
        ("token", "PUT /v1/maps/flat", True),
    ],
)
def test_each_role_may_do_its_work_only(
    locked: TestClient, role: str, path: str, allowed: bool
) -> None:
    method, address = path.split()
    headers = bearing(TOKENS[role])
    may = {"look_token": "look", "search_token": "search", "token": "administer"}[role]
    assert locked.get("/v1/robots", headers=headers).json()["role"] == may
    answer = locked.request(method, address, headers=headers)
    assert (answer.status_code != 403) == allowed
    if not allowed:
        assert "gateway." in answer.json()["detail"]


def protocols(token: str) -> list[str]:
    return [
        security.LIVE_PROTOCOL,
        security.TOKEN_PROTOCOL + urlsafe_b64encode(token.encode()).decode().rstrip("="),
    ]


def test_the_live_state_needs_a_token_in_the_header_or_the_protocol(locked: TestClient) -> None:
    address = "ws://localhost:8080/v1/live"
    with locked.websocket_connect(address, headers=bearing("0123")) as socket:
        assert socket.receive_json()["services"]
    with locked.websocket_connect(address, subprotocols=protocols("0123")) as socket:
        assert socket.accepted_subprotocol == security.LIVE_PROTOCOL
        assert socket.receive_json()["services"]
    for wrong in ([], [security.LIVE_PROTOCOL], protocols("012"), [security.TOKEN_PROTOCOL + "x"]):
        with pytest.raises(WebSocketDisconnect), locked.websocket_connect(address, wrong):
            pass


def test_the_right_token_is_served_whatever_was_guessed(
    locked: TestClient, caplog: pytest.LogCaptureFixture
) -> None:
    for number in range(20):
        answer = locked.get("/v1/map", headers=bearing(f"guess{number}"))
        assert (answer.status_code, answer.headers["WWW-Authenticate"]) == (401, "Bearer")
    assert locked.get("/v1/map", headers=bearing("0123")).status_code == 200
    assert "guess" not in caplog.text
    assert caplog.text.count("wrong tokens") == 1


def test_a_large_body_without_a_stated_length_is_refused(client: TestClient) -> None:
    def chunks() -> Iterator[bytes]:
        for _ in range(security.MAX_BODY_BYTES // 1000 + 2):
            yield b" " * 1000

    answer = client.post("/v1/searches", content=chunks(), headers=JSON)
    assert answer.status_code == 413
    assert answer.headers["Content-Type"] == "application/problem+json"


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", ""])
def test_only_json_is_read(client: TestClient, kind: str) -> None:
    body = b'{"text": "sofa"}'
    answer = client.post("/v1/queries", content=body, headers={"Content-Type": kind})
    assert answer.status_code == 415
    assert "application/json" in answer.json()["detail"]


def test_a_body_that_never_comes_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(security, "BODY_TIMEOUT_S", 0.05)
    assert answer_to(anyio.sleep_forever)["status"] == 408


def answer_to(receive: Any) -> Message:
    """The response to a POST whose body comes from ``receive``."""
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    async def reached(_scope: Scope, _receive: Receive, _send: Send) -> None:
        raise AssertionError("the request was let through")

    headers = [(b"host", b"localhost"), (b"content-type", b"application/json")]
    scope = {"type": "http", "method": "POST", "path": "/v1/queries", "headers": headers}
    anyio.run(security.SecurityMiddleware(reached, GatewayConfig()), scope, receive, send)
    return sent[0]


@pytest.mark.parametrize(
    ("request_line", "role"),
    [
        ("GET /", Role.NOBODY),
        ("GET /statics", Role.LOOK),
        ("GET /v1/map.png", Role.LOOK),
        ("OPTIONS /v1/map", Role.LOOK),
        ("POST /mcp", Role.LOOK),
        ("DELETE /v1/searches/", Role.ADMINISTER),
        ("PATCH /v1/searches/s1", Role.ADMINISTER),
        ("DELETE /v1/objects/s1", Role.ADMINISTER),
        ("POST /v1/searches/s1/again", Role.SEARCH),
        ("POST /v1/maps/s1/again", Role.ADMINISTER),
        ("POST /v1/new", Role.ADMINISTER),
    ],
)
def test_what_has_no_rule_needs_the_highest_role(request_line: str, role: Role) -> None:
    assert security.required_role(*request_line.split()) is role
