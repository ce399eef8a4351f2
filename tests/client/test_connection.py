"""Requests as they are sent, errors for bad replies, timeouts and addresses, event streams."""

from __future__ import annotations

import itertools
import json

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap import Client, InvalidSetting, OneMapError, Unreachable
from onemap.connection import StreamMessage, stream_messages

STREAM = (
    b": ping\n\nretry: 2000\nevent: status\ndata: {}\n\n"
    b"data: one\r\ndata:two\r\n\r\nevent: problem\n\nevent: cut"
)
MESSAGES = [StreamMessage("status", "{}"), StreamMessage("message", "one\ntwo")]


def client_at(transport: httpx.MockTransport) -> Client:
    return Client("http://robot:8080", "secret", transport=transport)


def replying(status: int, body: object) -> httpx.MockTransport:
    return httpx.MockTransport(lambda _: httpx.Response(status, json=body))


def failing(problem: type[httpx.HTTPError]) -> httpx.MockTransport:
    def handle(request: httpx.Request) -> httpx.Response:
        raise problem("no")

    return httpx.MockTransport(handle)


def test_a_request_holds_the_token_and_its_body() -> None:
    seen: list[tuple[str, str, object]] = []

    def handle(request: httpx.Request) -> httpx.Response:
        assert request.headers["Authorization"] == "Bearer secret"
        seen.append((request.method, request.url.path, json.loads(request.content)))
        return httpx.Response(200, json={"text": "red sofa", "regions": []})

    with client_at(httpx.MockTransport(handle)) as client:
        client.query("red sofa", 3)
    assert seen == [("POST", "/v1/queries", {"text": "red sofa", "max_regions": 3})]


def test_an_error_without_detail_is_reported_by_its_status() -> None:
    with pytest.raises(OneMapError, match="answers 502 Bad Gateway") as error:
        client_at(replying(502, ["?"])).status()
    assert (error.value.type, error.value.title, error.value.temporary) == ("", "", True)
    page = httpx.MockTransport(lambda _: httpx.Response(500, html="<html>"))
    with pytest.raises(OneMapError, match="answers 500 "):
        client_at(page).status()


def test_without_a_server_the_remedy_is_named() -> None:
    with pytest.raises(
        Unreachable, match=r"No gateway at http://robot:8080: start .*onemap up"
    ) as e:
        client_at(failing(httpx.ConnectError)).status()
    assert (e.value.url, e.value.timed_out, e.value.status) == ("http://robot:8080", False, 0)
    assert e.value.temporary


def test_a_timeout_is_reported_with_its_length() -> None:
    client = Client(timeout_s=2.5, transport=failing(httpx.ReadTimeout))
    with pytest.raises(Unreachable, match=r"did not answer within 2\.5 s") as error:
        client.status()
    assert error.value.timed_out
    with pytest.raises(Unreachable, match="did not answer within 60 s"):
        client.maps.save("flat")


@pytest.mark.parametrize("body", ["hello", [], {"text": "sofa"}, {"text": "sofa", "regions": [1]}])
def test_another_program_on_the_port_is_recognised(body: object) -> None:
    with pytest.raises(OneMapError, match="another program"):
        client_at(replying(200, body)).query("sofa")


@pytest.mark.parametrize("url", ["robot:8080", "ftp://robot", "http://[::1", "http://a b", ""])
def test_a_wrong_url_is_refused(url: str) -> None:
    with pytest.raises(InvalidSetting) as error:
        Client(url)
    assert repr(url) in str(error.value)
    assert isinstance(error.value, ValueError)


@pytest.mark.parametrize("token", ["schlüssel", "a\nb"])
def test_a_token_that_cannot_be_sent_is_refused(token: str) -> None:
    with pytest.raises(InvalidSetting, match="token"):
        Client(token=token)


@given(st.lists(st.integers(0, len(STREAM)), max_size=8))
def test_messages_do_not_depend_on_how_the_bytes_arrive(cuts: list[int]) -> None:
    places = [0, *sorted(cuts), len(STREAM)]
    chunks = [STREAM[a:b] for a, b in itertools.pairwise(places)]
    assert list(stream_messages(chunks)) == MESSAGES
