"""A search is shown until it ends, also while the gateway is away."""

from __future__ import annotations

import io
import json
import os
import signal
from typing import Any

import httpx
import pytest
from rich.console import Console

from onemap import Client
from onemap_tools.cli.search import again, all_found, arrived, drive, search

RESULT: dict[str, Any] = {
    "name": "sofa",
    "outcome": "found",
    "reason": "seen and confirmed",
    "position_m": [1.0, 2.0, 0.4],
    "score": 0.9,
    "duration_s": 30.0,
    "path_length_m": 7.5,
    "start_xy_m": [0.0, 0.0],
    "end_xy_m": [1.0, 1.2],
}


def report(state: str, *results: dict[str, Any]) -> dict[str, Any]:
    return {
        "id": "s1",
        "state": state,
        "objects": ["sofa"],
        "index": 0,
        "target": "sofa",
        "reason": "walking",
        "results": list(results),
        "elapsed_s": 1.0,
        "path_length_m": 2.0,
    }


STATUS = {"streams": [{"name": "revision", "age_s": 0.25, "rate_hz": 5.0}]}


def gateway_client(*answers: dict[str, Any] | int, status: dict[str, Any] | None = None) -> Client:
    """Answers these in turn (a number is an error of that status), the last one for ever.

    /v1/status answers with ``status``, or 404 without.
    """
    waiting = list(answers)

    def handle(request: httpx.Request) -> httpx.Response:
        if request.url.path == "/v1/status":
            return httpx.Response(200, json=status) if status else httpx.Response(404)
        answer = waiting.pop(0) if len(waiting) > 1 else waiting[0]
        if isinstance(answer, int):
            return httpx.Response(answer, json={"detail": "The planner is not running."})
        return httpx.Response(200, json=answer)

    return Client(transport=httpx.MockTransport(handle))


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_tools.cli.search.POLL_S", 0.0)


def console() -> Console:
    return Console(file=io.StringIO(), width=200)


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_search_is_shown_until_it_ends() -> None:
    out = console()
    gateway = gateway_client(report("exploring"), report("approaching"), report("found", RESULT))
    final = search(gateway, ("sofa",), out)
    assert all_found(final.report)
    assert final.exit_code(done=True) == 0
    assert "sofa: approaching" in text_of(out)


def test_an_absent_planner_is_waited_for() -> None:
    out = console()
    gateway = gateway_client(report("exploring"), 503, 503, report("found", RESULT))
    assert all_found(search(gateway, ("sofa",), out).report)
    assert "The planner is not running." in text_of(out)


def test_ctrl_c_cancels_and_is_told_from_a_search_without_success() -> None:
    asked: list[str] = []

    def handle(request: httpx.Request) -> httpx.Response:
        asked.append(request.method)
        if request.method == "GET" and "DELETE" not in asked:
            os.kill(os.getpid(), signal.SIGINT)  # handled before the next wait
        state = "cancelled" if "DELETE" in asked else "exploring"
        return httpx.Response(200, json=report(state))

    final = search(Client(transport=httpx.MockTransport(handle)), ("sofa",), console())
    assert "DELETE" in asked
    assert final.exit_code(done=all_found(final.report)) == 130


def test_map_updates_come_from_the_gateway() -> None:
    out = console()
    search(
        gateway_client(report("exploring"), report("found", RESULT), status=STATUS), ("sofa",), out
    )
    assert "map 0.2 s old, 5.0 updates/s" in text_of(out)


@pytest.mark.parametrize(
    "status", [None, {"streams": []}, {"streams": [{**STATUS["streams"][0], "age_s": None}]}]
)
def test_unknown_map_updates_are_left_out(status: dict[str, Any] | None) -> None:
    out = console()
    search(
        gateway_client(report("exploring"), report("found", RESULT), status=status), ("sofa",), out
    )
    assert "sofa: exploring" in text_of(out)
    assert "map" not in text_of(out)


def test_a_search_is_complete_only_if_every_object_was_found() -> None:
    missed = {**RESULT, "outcome": "not_found"}
    assert all_found(report("found", RESULT))
    assert not all_found(report("not_found", missed))
    assert not all_found(report("cancelled"))


DRIVE: dict[str, Any] = {
    **report("approaching"),
    "objects": [],
    "target": "",
    "reason": "driving to the place (1.00, -2.50)",
}


def test_a_drive_is_shown_until_it_ends() -> None:
    out = console()
    gateway = gateway_client(DRIVE, DRIVE, {**DRIVE, "state": "arrived"})
    final = drive(gateway, (1.0, -2.5), out, look=False).report
    assert arrived(final)
    assert "search: approaching; robot drove 2.0 m; driving to the place" in text_of(out)
    assert "[" not in text_of(out)  # there are no objects to count


@pytest.mark.parametrize(("look", "member"), [(False, "go_to_m"), (True, "look_at_m")])
def test_a_drive_asks_for_the_place_or_for_a_view_of_it(look: bool, member: str) -> None:
    sent: list[bytes] = []

    def handle(request: httpx.Request) -> httpx.Response:
        sent.append(request.content)
        return httpx.Response(201, json={**DRIVE, "state": "failed"})

    gateway = Client(transport=httpx.MockTransport(handle))
    final = drive(gateway, (1.0, -2.5), console(), look=look)
    assert not arrived(final.report)
    assert final.exit_code(done=False) == 1
    assert json.loads(sent[0]) == {member: [1.0, -2.5]}


@pytest.mark.parametrize(("any_order", "body"), [(False, {}), (True, {"order": "any"})])
def test_the_order_is_asked_for_only_if_it_is_any(any_order: bool, body: dict[str, Any]) -> None:
    sent: list[Any] = []

    def handle(request: httpx.Request) -> httpx.Response:
        sent.append(json.loads(request.content))
        return httpx.Response(200, json=report("found", RESULT))

    client = Client(transport=httpx.MockTransport(handle))
    search(client, ("sofa", "bed"), console(), any_order=any_order)
    assert sent == [{"objects": ["sofa", "bed"], **body}]


@pytest.mark.parametrize(
    ("what", "command"),
    [
        ({"objects": ["sofa", "teddy bear"], "order": "given"}, "onemap search 'teddy bear'"),
        ({"objects": ["bed", "sofa"], "order": "any"}, "onemap search --any-order bed"),
        ({"kind": "go_to", "place_m": [1.0, -2.5]}, "onemap go 1.0 -2.5"),
        ({"kind": "look_at", "place_m": [1.0, 2.5]}, "onemap go --look 1.0 2.5"),
    ],
)
def test_an_interrupted_search_is_offered_for_what_it_did_not_find(
    what: dict[str, Any], command: str
) -> None:
    find = {**report("interrupted", RESULT), "kind": "find", "place_m": None, "order": "given"}
    assert again(find | what).endswith(f"Search again: {command}")
    assert again(find | what | {"state": "cancelled"}) == ""
