"""Searches are followed over a real gateway, and over gateways that break off."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from typing import Any

import httpx
import pytest

from onemap import (
    Client,
    InvalidSetting,
    OneMapError,
    Retry,
    SearchChanged,
    SearchEvent,
    SearchInterrupted,
    SearchLimits,
)
from onemap_shared.messages import SearchState
from tests.gateway.fakes import FakePlanner

REPORT: dict[str, Any] = {
    "id": "s1",
    "objects": ["sofa"],
    "results": [],
    "updated_ns": 5,
    "active": True,
}
NOW = Retry(first_s=0.0, attempts=3)


def states(events: Iterator[SearchEvent]) -> list[str]:
    return [event.search.state for event in events if isinstance(event, SearchChanged)]


def test_a_search_is_followed_until_it_is_over(client: Client, planner: FakePlanner) -> None:
    search = client.search(["sofa", "kettle"])
    assert search.latest.objects == ("sofa", "kettle")
    events = search.events()
    assert str(next(events)) == "sofa: exploring: looking around"
    planner.move(SearchState.APPROACHING, "there")
    assert str(next(events)) == "sofa: approaching: there"
    planner.move(SearchState.NOT_FOUND)
    assert states(events) == ["not_found"]
    assert not search.latest.active
    assert not search.latest.all_found
    assert search.wait() == search.latest


def test_who_follows_may_ask_again_when_the_planner_has_ended(
    client: Client, planner: FakePlanner
) -> None:
    events = client.search("sofa").events(again=True)
    assert str(next(events)) == "sofa: exploring: looking around"
    planner.move(SearchState.INTERRUPTED, "the planner was stopped")
    assert states(islice(events, 2)) == ["interrupted", "exploring"]
    assert len(planner.requests) == 2
    planner.move(SearchState.NOT_FOUND)
    assert states(events) == ["not_found"]


def test_who_follows_does_not_start_again_what_somebody_stopped(
    client: Client, planner: FakePlanner
) -> None:
    followed = client.search("sofa")
    planner.move(SearchState.INTERRUPTED, "the planner was stopped")
    client.searches.get(followed.id).again().cancel()
    assert states(followed.events(again=True)) == ["interrupted", "cancelled"]
    assert len(planner.requests) == 2


def test_a_search_is_found_again_and_cancelled(client: Client, planner: FakePlanner) -> None:
    started = client.search("sofa")
    again = client.searches.get(started.id)
    assert again.id == client.searches.get().id == "s1"
    assert [repr(each) for each in client.searches.list()] == ["RemoteSearch(s1, sofa, exploring)"]
    with pytest.raises(OneMapError, match="DELETE /v1/searches/s1") as error:
        client.search("kettle")
    assert (error.value.status, error.value.search_id) == (409, "s1")
    assert again.status().active
    assert again.cancel().state == "cancelled"
    assert started.wait().reason == "cancelled by the user"


class BrokenBody(httpx.SyncByteStream):
    """A body that ends before its time."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def __iter__(self) -> Iterator[bytes]:
        yield self._content
        raise httpx.ReadError("connection reset")


def status(state: str, **members: Any) -> bytes:
    return b"event: status\ndata: " + json.dumps({**REPORT, "state": state, **members}).encode()


def client_of(*streams: bytes | int, retry: Retry = NOW) -> Client:
    """A client whose event streams are these, in turn, the last one for ever.

    A number is a refusal with that status, 0 no connection at all; an incomplete body breaks off.
    """
    waiting = list(streams)

    def handle(request: httpx.Request) -> httpx.Response:
        if not request.url.path.endswith("/events"):
            return httpx.Response(200, json={**REPORT, "state": "exploring"})
        stream = waiting.pop(0) if len(waiting) > 1 else waiting[0]
        if stream == 0:
            raise httpx.ConnectError("refused")
        if isinstance(stream, int):
            return httpx.Response(stream, json={"detail": "The planner is not running."})
        ends = stream.endswith(b"\n\n")
        return httpx.Response(200, stream=httpx.ByteStream(stream) if ends else BrokenBody(stream))

    return Client(retry=retry, transport=httpx.MockTransport(handle))


def test_an_interrupted_stream_is_opened_again() -> None:
    exploring = status("exploring", elapsed_s=1.0) + b"\n\n"
    later = status("exploring", elapsed_s=3.0) + b"\n\n"
    client = client_of(exploring + b"event: stat", 0, 503, later, later + status("found") + b"\n\n")
    first, interrupted, *rest = client.search("sofa").events()
    assert isinstance(first, SearchChanged)
    assert isinstance(interrupted, SearchInterrupted)
    assert str(interrupted).startswith("No gateway at ")
    assert states(iter(rest)) == ["found"]  # the same state is told once


@pytest.mark.parametrize("refusal", [404, 401])
def test_a_lasting_refusal_ends_the_events_at_once(refusal: int) -> None:
    search = client_of(refusal).search("sofa")
    with pytest.raises(OneMapError, match="planner"):
        next(search.events())


def test_an_event_that_cannot_be_read_is_an_error() -> None:
    for body in (b"{", b"[]", b'{"id": "s1"}'):
        search = client_of(b"event: status\ndata: " + body + b"\n\n").search("sofa")
        with pytest.raises(OneMapError, match="cannot be read"):
            search.wait()


def test_a_drive_to_a_place_ends_as_arrived(client: Client, planner: FakePlanner) -> None:
    drive = client.go_to(1, -2.5)
    assert (drive.latest.kind, drive.latest.place_m) == ("go_to", (1.0, -2.5))
    assert (drive.latest.objects, drive.latest.target) == ((), "")
    assert str(next(drive.events())).startswith("(1, -2.5): ")
    planner.move(SearchState.ARRIVED, "standing 0.05 m from it")
    assert drive.wait().arrived
    assert not drive.latest.active
    assert not drive.latest.all_found  # nothing was sought


def test_limits_are_part_of_the_request(client: Client, planner: FakePlanner) -> None:
    limits = SearchLimits(max_distance_m=20.0)
    client.search(["sofa", "bed"], limits=limits)
    planner.move(SearchState.FAILED)
    client.go_to(1.0, 2.0, limits=SearchLimits(max_time_s=30.0))
    planner.move(SearchState.FAILED)
    client.look_at(1.0, 2.0, limits=limits)
    asked = [(each.max_distance_m, each.max_time_s) for each in planner.requests]
    assert asked == [(20.0, 0.0), (0.0, 30.0), (20.0, 0.0)]


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_a_limit_that_is_none_is_refused_here(value: float) -> None:
    with pytest.raises(InvalidSetting, match=r"max_time_s is .*: a limit must be positive"):
        SearchLimits(max_time_s=value)
