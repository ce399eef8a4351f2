"""A search is followed until it ends; what is printed of the gateway's replies."""

from __future__ import annotations

import io
import json
import os
import signal
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest
from rich.console import Console

from onemap import Client, QueryInterrupted, QueryResult
from onemap_gateway.http.reply_docs import EXAMPLES
from onemap_tools.cli import remote
from onemap_tools.cli.remote import follow, is_done
from onemap_tools.cli.terminal import plain_console
from onemap_tools.errors import CliError
from tests.shared.samples import PNG

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
STATUS = {"streams": [{"name": "revision", "age_s": 0.25, "rate_hz": 5.0}]}


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


DRIVE = {**report("approaching"), "objects": [], "target": "", "reason": "driving to the place"}


class Gateway:
    """Answers these in turn (a number is an error of that status), the last one for ever.

    /v1/status answers with ``status``, or 404 without.
    """

    def __init__(self, *answers: dict[str, Any] | int, status: Any = None) -> None:
        self._waiting, self._status = list(answers), status
        self.sent: list[Any] = []
        self.client = Client(transport=httpx.MockTransport(self._handle))

    def _handle(self, request: httpx.Request) -> httpx.Response:
        if request.url.path == "/v1/status":
            return httpx.Response(200, json=self._status) if self._status else httpx.Response(404)
        self.sent.append(json.loads(request.content or "null"))
        answer = self._waiting.pop(0) if len(self._waiting) > 1 else self._waiting[0]
        if isinstance(answer, int):
            return httpx.Response(answer, json={"detail": "The planner is not running."})
        return httpx.Response(200, json=answer)


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_tools.cli.remote.POLL_S", 0.0)


@pytest.fixture
def console() -> Console:
    console = plain_console(file=io.StringIO())
    console.width = 200
    return console


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_search_is_shown_until_it_ends_also_while_the_planner_is_away(console: Console) -> None:
    gateway = Gateway(
        report("exploring"), report("approaching"), 503, 503, report("found", RESULT), status=STATUS
    )
    start = partial(gateway.client.search, ("sofa", "bed"), any_order=True)
    final, exit_code = follow(gateway.client, start, console)
    assert (final["results"], exit_code) == ([RESULT], 0)
    assert gateway.sent[0] == {"objects": ["sofa", "bed"], "order": "any"}
    for part in ("sofa: approaching", "The planner is not running.", "map 0.2 s old, 5.0 updates"):
        assert part in text_of(console)


def test_ctrl_c_cancels_and_is_told_from_a_search_without_success(console: Console) -> None:
    asked: list[str] = []

    def handle(request: httpx.Request) -> httpx.Response:
        asked.append(request.method)
        if request.method == "GET" and "DELETE" not in asked:
            os.kill(os.getpid(), signal.SIGINT)  # handled before the next wait
        state = "cancelled" if "DELETE" in asked else "exploring"
        return httpx.Response(200, json=report(state))

    client = Client(transport=httpx.MockTransport(handle))
    assert follow(client, partial(client.search, "sofa"), console)[1] == 130
    assert "DELETE" in asked
    failed = Gateway(report("not_found")).client
    assert follow(failed, partial(failed.search, "sofa"), console)[1] == 1


@pytest.mark.parametrize(
    "status", [None, {"streams": []}, {"streams": [{**STATUS["streams"][0], "age_s": None}]}]
)
def test_unknown_map_updates_are_left_out_of_a_drive(status: Any, console: Console) -> None:
    gateway = Gateway(DRIVE, {**DRIVE, "state": "arrived"}, status=status)
    final, exit_code = follow(gateway.client, lambda: gateway.client.go_to(1.0, -2.5), console)
    assert (exit_code, is_done(final), is_done(DRIVE)) == (0, True, False)
    assert gateway.sent[0] == {"go_to_m": [1.0, -2.5]}
    assert (
        text_of(console)
        .rstrip()
        .endswith("search: approaching; robot drove 2.0 m; driving to the place")
    )


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
    assert remote.again(find | what).endswith(f"Search again: {command}")
    assert remote.again(find | what | {"state": "cancelled"}) == ""


def test_a_query_says_its_verdict_and_from_where_it_was_seen(console: Console) -> None:
    (found, absent) = EXAMPLES["QueryResult"]
    remote.describe_query(found, console)
    remote.describe_query(absent, console)
    remote.describe_query({**found, "did_you_mean": ["couch", "bed"]}, console)
    said = " ".join(text_of(console).split())
    for part in (
        "'sofa' is at (2.35, -1.10) m, with the score 0.91.",
        "(0.60, -0.40) m, -22",
        "00:00:12",
        "0.1 to 0.9 m",
        "1.7 x 1.0 m",
        "was not seen, but only 62 % of the reachable area was looked at",
        "did you mean 'couch' or 'bed'?",
    ):
        assert part in said


def test_a_reply_of_an_older_gateway_is_printed_too(console: Console) -> None:
    why = "Nothing on the map looks like 'yeti': the best score is 0.04. Did you mean 'bed'?"
    remote.describe_query({"text": "yeti", "regions": [], "message": why}, console)
    region = {"rank": 1, "centre_m": [2.35, -1.1], "extent_m": [1.5, -1.6, 3.2, -0.6], "score": 0.9}
    remote.describe_query({"text": "sofa", "regions": [region]}, console)
    assert why in " ".join(text_of(console).split())
    assert "(2.35, -1.10) m" in text_of(console)


def test_a_followed_query_prints_each_answer(capsys: pytest.CaptureFixture[str]) -> None:
    (found, absent) = EXAMPLES["QueryResult"]
    results = [QueryResult.of(each) for each in (absent, found)]
    away = QueryInterrupted("The mapper is away.")
    remote.follow_query([results[0], away, results[1]], as_json=True)
    said = capsys.readouterr()
    assert [json.loads(line)["text"] for line in said.out.splitlines()] == ["skateboard", "sofa"]
    assert "The mapper is away." in said.err
    remote.follow_query(results, as_json=False)
    assert "'sofa' is at (2.35, -1.10) m" in capsys.readouterr().out


def test_a_crop_is_a_png_or_jpeg(tmp_path: Path) -> None:
    (path := tmp_path / "crop.png").write_bytes(PNG)
    assert remote.read_crop(path) == PNG
    (path := tmp_path / "crop.gif").write_bytes(b"GIF89a")
    with pytest.raises(CliError, match=r"crop\.gif: the image is no PNG and no JPEG"):
        remote.read_crop(path)
    with pytest.raises(CliError, match=r"cannot read .*none\.png: No such file"):
        remote.read_crop(tmp_path / "none.png")
