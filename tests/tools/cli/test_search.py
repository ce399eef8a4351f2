"""Following a search through a gateway that may be away."""

from __future__ import annotations

import io
from typing import Any

import httpx
import pytest
from rich.console import Console

from onemap_tools.cli.search import (
    PATIENCE,
    SearchHandle,
    all_found,
    describe_query,
    describe_search,
    progress_of,
    search,
)
from onemap_tools.client import GatewayClient
from onemap_tools.errors import CliError

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


def gateway_client(
    *answers: dict[str, Any] | int, status: dict[str, Any] | None = None
) -> GatewayClient:
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

    return GatewayClient(transport=httpx.MockTransport(handle))


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_tools.cli.search.POLL_S", 0.0)


def console() -> Console:
    return Console(file=io.StringIO(), width=200)


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_search_is_followed_to_its_end() -> None:
    out = console()
    gateway = gateway_client(report("exploring"), report("approaching"), report("found", RESULT))
    final = search(gateway, ("sofa",), out)
    assert all_found(final)
    assert "sofa: approaching" in text_of(out)


def test_a_planner_that_is_away_for_a_while_is_waited_for() -> None:
    out = console()
    gateway = gateway_client(report("exploring"), 503, 503, report("found", RESULT))
    assert all_found(search(gateway, ("sofa",), out))
    assert "The planner is not running." in text_of(out)


def test_the_pace_of_the_map_comes_from_the_gateway() -> None:
    out = console()
    search(
        gateway_client(report("exploring"), report("found", RESULT), status=STATUS), ("sofa",), out
    )
    assert "map 0.2 s old, 5.0 updates/s" in text_of(out)


@pytest.mark.parametrize(
    "status", [None, {"streams": []}, {"streams": [{**STATUS["streams"][0], "age_s": None}]}]
)
def test_a_map_of_which_nobody_tells_is_left_out(status: dict[str, Any] | None) -> None:
    out = console()
    search(
        gateway_client(report("exploring"), report("found", RESULT), status=status), ("sofa",), out
    )
    assert "sofa: exploring" in text_of(out)
    assert "map" not in text_of(out)


def test_patience_ends() -> None:
    handle = SearchHandle(gateway_client(503), report("exploring"))
    for _ in range(PATIENCE):
        assert handle.poll() == "The planner is not running."
    with pytest.raises(CliError, match="planner"):
        handle.poll()


def test_not_found_is_told_with_its_reason() -> None:
    out = console()
    missed = {**RESULT, "outcome": "not_found", "position_m": None, "reason": "searched it all"}
    final = report("not_found", missed)
    describe_search(final, out)
    assert not all_found(final)
    assert "not found" in text_of(out)
    assert "searched it all" in text_of(out)


def test_progress_counts_what_is_settled() -> None:
    progress = progress_of(report("exploring", RESULT))
    assert progress.done == (("sofa", "found"),)
    assert progress.position_m is None


def test_a_query_lists_places_best_first() -> None:
    out = console()
    region = {
        "rank": 1,
        "centre_m": [2.35, -1.1],
        "extent_m": [1.5, -1.6, 3.2, -0.6],
        "score": 0.91,
    }
    reply = {"text": "sofa", "regions": [region], "did_you_mean": []}
    describe_query(reply, out)
    assert "did you mean" not in text_of(out)
    describe_query({**reply, "did_you_mean": ["couch", "bed"]}, out)
    assert "did you mean 'couch' or 'bed'?" in text_of(out)
    assert "(2.35, -1.10) m" in text_of(out)
    assert "1.7 x 1.0 m" in text_of(out)


def test_a_query_without_answer_says_so() -> None:
    out = console()
    why = "Nothing on the map looks like 'yeti': the best score is 0.04. Did you mean 'bed'?"
    describe_query({"text": "yeti", "regions": [], "message": why}, out)
    assert why in " ".join(text_of(out).split())
