"""Sockets on which only the gateway speaks, by WS /v1/queries/live: standing queries."""

from __future__ import annotations

from base64 import urlsafe_b64encode

import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.security import LIVE_PROTOCOL, TOKEN_PROTOCOL
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import FakeMapper, client_of, gateway_on
from tests.gateway.http.test_query_events import ChangingMapper

LIVE = "ws://localhost:8080/v1/queries/live"
TOKEN = "a-token-for-looking-1"


def drain(socket: WebSocketTestSession) -> None:
    while True:
        socket.receive_json()


def code_at_the_end(socket: WebSocketTestSession) -> int:
    """The code with which the gateway closes the socket."""
    with pytest.raises(WebSocketDisconnect) as end:
        drain(socket)
    return end.value.code


def test_each_text_is_answered_and_again_when_it_changes(router: MemoryRouter) -> None:
    mapper = ChangingMapper(router)
    with (
        gateway_on(router) as gateway,
        client_of(gateway).websocket_connect(f"{LIVE}?text=sofa&text=kite") as socket,
    ):
        first = [socket.receive_json() for _ in range(2)]
        assert [(each["event"], each["data"]["text"]) for each in first] == [
            ("answer", "sofa"),
            ("answer", "kite"),
        ]
        mapper.moved_m = 0.3
        mapper.announce(1)
        changed = socket.receive_json()
        assert (changed["event"], changed["data"]["text"]) == ("answer", "sofa")
        assert changed["data"]["regions"][0]["centre_m"] == pytest.approx([0.65, 1.45])


def test_parameters_are_those_of_the_events(client: TestClient, mapper: FakeMapper) -> None:
    asked = "text=sofa&negative=bed&negative=desk&area_m=0,-1,2,3&max_regions=1"
    with client.websocket_connect(f"{LIVE}?{asked}") as socket:
        assert len(socket.receive_json()["data"]["regions"]) == 1
    request = mapper.asked[-1]
    assert (request.negatives, request.area_m) == (("bed", "desk"), (0.0, -1.0, 2.0, 3.0))


def test_an_empty_map_is_a_problem_that_passes(router: MemoryRouter) -> None:
    mapper = ChangingMapper(router)
    mapper.empty = True
    with (
        gateway_on(router) as gateway,
        client_of(gateway).websocket_connect(f"{LIVE}?text=sofa") as socket,
    ):
        problem = socket.receive_json()
        assert (problem["event"], problem["data"]["status"]) == ("problem", 409)
        mapper.empty = False
        assert socket.receive_json()["event"] == "answer"


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        ("", "text"),
        ("text=", "empty"),
        ("text=flurb", "flurb"),
        ("text=sofa&area_m=here", "area_m"),
        ("text=sofa&max_regions=0", "max_regions"),
        ("text=sofa&max_regions=many", "max_regions"),
        ("&".join(["text=sofa"] * 21), "text"),
        ("text=sofa&" + "&".join(["negative=bed"] * 11), "negative"),
    ],
)
def test_what_cannot_be_followed_is_told_and_closed(
    client: TestClient, asked: str, reason: str
) -> None:
    with client.websocket_connect(f"{LIVE}?{asked}") as socket:
        problem = socket.receive_json()
        assert (problem["event"], problem["data"]["status"]) == ("problem", 422)
        assert reason in problem["data"]["detail"]
        assert code_at_the_end(socket) == 1008


def test_a_closing_gateway_closes_its_sockets(router: MemoryRouter) -> None:
    FakeMapper(router)
    with (
        gateway_on(router) as gateway,
        client_of(gateway).websocket_connect(f"{LIVE}?text=sofa") as socket,
    ):
        socket.receive_json()
        gateway.cache.begin_close()
        assert code_at_the_end(socket) == 1001


def test_what_a_client_sends_is_ignored(client: TestClient) -> None:
    with client.websocket_connect(f"{LIVE}?text=sofa") as socket:
        socket.send_text("{not json")
        socket.send_bytes(b"\x00")
        assert socket.receive_json()["event"] == "answer"


def test_looking_is_enough_and_needed(router: MemoryRouter) -> None:
    FakeMapper(router)
    with gateway_on(
        router, GatewayConfig.model_validate({"token": "all", "look_token": TOKEN})
    ) as gateway:
        client = client_of(gateway)
        with (
            pytest.raises(WebSocketDisconnect),
            client.websocket_connect(f"{LIVE}?text=sofa") as socket,
        ):
            socket.receive_json()
        encoded = urlsafe_b64encode(TOKEN.encode()).decode().rstrip("=")
        protocols = [LIVE_PROTOCOL, TOKEN_PROTOCOL + encoded]
        with client.websocket_connect(f"{LIVE}?text=sofa", subprotocols=protocols) as socket:
            assert socket.accepted_subprotocol == LIVE_PROTOCOL
            assert socket.receive_json()["event"] == "answer"


def test_a_page_of_another_site_may_not_listen(client: TestClient) -> None:
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect(
            f"{LIVE}?text=sofa", headers={"Origin": "https://evil.example"}
        ) as socket,
    ):
        socket.receive_json()
