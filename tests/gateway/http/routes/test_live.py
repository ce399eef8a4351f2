"""WS /v1/live."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway import fakes
from tests.gateway.fakes import client_of, gateway_on

LIVE = "ws://localhost:8080/v1/live"


def drain(socket: WebSocketTestSession) -> None:
    while True:
        socket.receive_json()


def test_states_keep_coming_and_the_trail_only_once(client: TestClient) -> None:
    with client.websocket_connect(LIVE) as socket:
        first, second = socket.receive_json(), socket.receive_json()
    assert first["trail_m"] == []
    assert second["trail_m"] is None
    assert first["ready"] is False


def test_the_newest_state_is_sent(router: MemoryRouter) -> None:
    publisher = router.bus("simulator").publish(keys.ROBOT_ODOMETRY)
    with gateway_on(router) as gateway, client_of(gateway).websocket_connect(LIVE) as socket:
        socket.receive_json()
        for index in range(1, 4):
            publisher.put(fakes.odometry(float(index), 0.0, sequence=index))
        while (state := socket.receive_json())["robot"] is None or state["robot"]["x_m"] < 3:
            pass
    assert state["robot"]["x_m"] == 3.0


def test_what_a_client_sends_is_ignored(client: TestClient) -> None:
    with client.websocket_connect(LIVE) as socket:
        socket.send_text("{not json")
        socket.send_bytes(b"\x00")
        assert socket.receive_json()["services"]


def test_a_closing_gateway_closes_its_sockets(router: MemoryRouter) -> None:
    with gateway_on(router) as gateway, client_of(gateway).websocket_connect(LIVE) as socket:
        socket.receive_json()
        gateway.cache.begin_close()
        with pytest.raises(WebSocketDisconnect) as end:
            drain(socket)
    assert end.value.code == 1001
