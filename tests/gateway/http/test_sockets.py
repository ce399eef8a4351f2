"""Sockets on which only the gateway speaks, by WS /v1/queries/live: standing queries."""

from __future__ import annotations

import json
from base64 import b64encode, urlsafe_b64encode
from contextlib import closing

import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import connect

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http import sockets
from onemap_gateway.http.security import LIVE_PROTOCOL, MAX_IMAGE_BODY_BYTES, TOKEN_PROTOCOL
from onemap_gateway.http.shared_results import MAX_IMAGE_STREAMS
from onemap_gateway.service import build
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MAX_IMAGE_BYTES
from tests.gateway.fakes import WAIT_S, FakeMapper, client_of, gateway_on
from tests.gateway.http.test_query_events import ChangingMapper
from tests.shared.samples import PNG

LIVE = "ws://localhost:8080/v1/queries/live"
TOKEN = "a-token-for-looking-1"
IMAGE = b64encode(PNG).decode()


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
        ("area_m=0,0,1,1", "text"),
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


@pytest.mark.parametrize("binary", [False, True])
def test_an_image_is_asked_for_in_the_first_message(router: MemoryRouter, binary: bool) -> None:
    mapper = ChangingMapper(router)
    body = json.dumps({"image": IMAGE, "area_m": [0, -1, 2, 3], "max_regions": 1})
    with gateway_on(router) as gateway:
        with client_of(gateway).websocket_connect(LIVE) as socket:
            if binary:
                socket.send_bytes(body.encode())
            else:
                socket.send_text(body)
            answer = socket.receive_json()
            assert (answer["event"], answer["data"]["text"]) == ("answer", "image")
            assert (answer["data"]["calibrated"], len(answer["data"]["regions"])) == (False, 1)
            assert gateway.image_streams.open == 1
            mapper.moved_m = 0.3
            mapper.announce(1)
            assert socket.receive_json()["data"]["regions"][0]["centre_m"][0] == 0.65
        assert gateway.image_streams.open == 0
    assert set(mapper.images) == {PNG}
    assert mapper.asked[-1].area_m == (0.0, -1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("body", "status", "reason"),
    [
        ("", 400, "not valid JSON"),
        ("{not json", 400, "not valid JSON"),
        ("[]", 422, "object"),
        ("{}", 422, "exactly one of 'text'"),
        ('{"text": "flurb"}', 422, "flurb"),
        ('{"image": "R0lGODlh"}', 422, "no PNG and no JPEG"),
        ('{"text": "sofa", "include_grid": true}', 422, "'include_grid' is for"),
        ('{"text": "sofa", "speed": 3}', 422, "'speed' is no field"),
    ],
)
def test_a_first_message_that_cannot_be_followed_is_told_and_closed(
    client: TestClient, body: str, status: int, reason: str
) -> None:
    with client.websocket_connect(LIVE) as socket:
        socket.send_text(body)
        problem = socket.receive_json()
        assert (problem["event"], problem["data"]["status"]) == ("problem", status)
        assert reason in problem["data"]["detail"]
        assert code_at_the_end(socket) == 1008


def test_a_first_message_that_never_comes_is_given_up(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sockets, "BODY_TIMEOUT_S", 0.05)
    with client.websocket_connect(LIVE) as socket:
        problem = socket.receive_json()
        assert (problem["event"], problem["data"]["status"]) == ("problem", 408)
        assert "send the body of POST /v1/queries" in problem["data"]["detail"]
        assert code_at_the_end(socket) == 1008


def test_a_client_that_leaves_before_its_first_message_leaves_nothing(
    router: MemoryRouter,
) -> None:
    with gateway_on(router) as gateway, client_of(gateway).websocket_connect(LIVE):
        pass  # raises if the gateway fails
    assert gateway.image_streams.open == 0


def test_one_stream_too_many_with_an_image_is_refused(router: MemoryRouter) -> None:
    FakeMapper(router)
    with gateway_on(router) as gateway:
        gateway.image_streams.open = MAX_IMAGE_STREAMS
        with client_of(gateway).websocket_connect(LIVE) as socket:
            socket.send_json({"image": IMAGE})
            problem = socket.receive_json()["data"]
            assert problem["status"] == 503
            assert "16 standing queries with an image are open" in problem["detail"]
            assert code_at_the_end(socket) == 1008
        with client_of(gateway).websocket_connect(LIVE) as socket:
            socket.send_json({"text": "sofa"})  # without an image there is no such limit
            assert socket.receive_json()["event"] == "answer"


def test_the_largest_image_fits_into_a_message(router: MemoryRouter) -> None:
    """Over a real connection, which has a limit of its own."""
    mapper = FakeMapper(router)
    image = PNG + bytes(MAX_IMAGE_BYTES - len(PNG))
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        address = f"ws://127.0.0.1:{worker.port}/v1/queries/live"
        with connect(address, open_timeout=WAIT_S) as socket:
            socket.send(json.dumps({"image": b64encode(image).decode()}))
            assert json.loads(socket.recv(timeout=WAIT_S))["event"] == "answer"
    assert set(mapper.images) == {image}


def test_a_message_larger_than_any_image_closes_the_socket(router: MemoryRouter) -> None:
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        address = f"ws://127.0.0.1:{worker.port}/v1/queries/live"
        with connect(address, open_timeout=WAIT_S) as socket:
            socket.send("x" * (MAX_IMAGE_BODY_BYTES + 1))
            with pytest.raises(ConnectionClosedError) as end:
                socket.recv(timeout=WAIT_S)
    assert end.value.rcvd is not None
    assert end.value.rcvd.code == 1009


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
