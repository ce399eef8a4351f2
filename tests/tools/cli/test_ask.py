"""Commands that ask a running robot or its map, follow a search, and say what came of it."""

from __future__ import annotations

import io
import itertools
import json
import os
import re
import signal
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from rich.console import Console
from typer.testing import CliRunner

from onemap import Client, MapObject, OneMapError, QueryResult
from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_tools import gateway
from onemap_tools.cli import remote
from onemap_tools.cli.app import app
from onemap_tools.cli.remote import follow, is_done
from onemap_tools.cli.terminal import plain_console
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.processes.network import any_free_port
from tests.gateway.fakes import FakeMapper
from tests.memory_bus import MemoryRouter
from tests.shared.samples import PNG
from tests.tools.cli.commands import error_of
from tests.tools.fake_gateway import fake_gateway

RUNNER = CliRunner()
REQUESTS = (
    "query red sofa",
    "search sofa",
    "objects",
    "places",
    "places name kitchen --at 1,-2",
    "go 1 -2.5",
    "status",
    "map info",
    "map merge flat",
)
RESULT: dict[str, Any] = {
    "name": "sofa",
    "outcome": "found",
    "reason": "confirmed",
    "position_m": [1.0, 2.0, 0.5],
    "duration_s": 30.0,
    "path_length_m": 7.5,
}
SEARCH: dict[str, Any] = {
    "id": "s1",
    "state": "found",
    "objects": ["sofa"],
    "results": [RESULT],
    "reason": "standing 0.05 m from the place (-1.20, -3.00)",
    "target": "",
    "elapsed_s": 12.0,
    "path_length_m": 3.5,
}
MISSED = {
    **SEARCH,
    "state": "not_found",
    "results": [{**RESULT, "outcome": "not_found", "position_m": None}],
    "reason": "searched all rooms",
}
ARRIVED = {**SEARCH, "state": "arrived", "objects": [], "results": []}
STATUS = {
    "ready": True,
    "problem": "no map",
    "services": [{"name": "mapper", "condition": "down", "problem": "It is [not] running."}],
    "streams": [
        {"name": "rgbd", "age_s": None, "rate_hz": 0, "received": 0, "missed": 7, "refused": 1}
    ],
}
OBJECTS = {"objects": [MapObject.model_json_schema()["examples"][0]]}
INFO = {
    "revision": 412,
    "age_s": 0.5,
    "bounds_m": [0.0, -1.0, 4.0, 5.0],
    "observed_m2": 20.0,
    "free_m2": 12.0,
    "occupied_m2": 6.5,
    "memory_bytes": 3_100_000,
    "rate_hz": 7.9,
    "update_ms": 21.0,
    "encoder_id": "mini-1",
    "text_space": "minilm",
}
CHANGE = {"path": "flat.npz", "cells_observed": 81, "frames_fused": 9, "file_bytes": 2_500_000}
SAVED = {
    "name": "flat",
    "file_bytes": 2_500_000,
    "saved_ns": 1_790_000_000_000_000_000,
    "encoder_id": "mini-1",
    "text_space": "minilm",
    "cell_size_m": 0.1,
    "cells_observed": 81,
    "frames_fused": 9,
    "problem": "",
    "saved_at": "2026-09-21T13:33:20Z",
}
CHANGED = "flat.npz: 81 cells from 9 frames, 2.5 MB.\n"
FOUND, ABSENT = QueryResult.model_json_schema()["examples"]
BOTH = {"answers": [FOUND, ABSENT]}
WENT = "standing 0.05 m from the place (-1.20, -3.00) (12 s, 3.5 m).\n"


@pytest.mark.parametrize(
    ("command", "request_line", "reply", "code", "printed"),
    [
        ("query sofa", "POST /v1/queries", FOUND, EXIT_OK, "'sofa' is in"),
        ("query sofa", "POST /v1/queries", ABSENT, EXIT_FAILED, "was not seen"),
        ("query sofa, bed", "POST /v1/queries", BOTH, EXIT_FAILED, "'sofa' is in"),
        ("search sofa", "POST /v1/searches", SEARCH, EXIT_OK, "7.5 m confirmed"),
        ("search sofa", "POST /v1/searches", MISSED, EXIT_FAILED, "searched all rooms\n"),
        ("go -1.2 -3", "POST /v1/searches", ARRIVED, EXIT_OK, f"Arrived: {WENT}"),
        ("go back", "POST /v1/searches", ARRIVED, EXIT_OK, f"Arrived: {WENT}"),
        ("go -1.2 -3", "POST /v1/searches", {**ARRIVED, "state": "failed"}, EXIT_FAILED, WENT),
        ("status", "GET /v1/status", STATUS, EXIT_OK, "mapper down It is [not] running."),
        ("status", "GET /v1/status", STATUS, EXIT_OK, "rgbd never 0.0 Hz 0 7 1"),
        ("status", "GET /v1/status", {**STATUS, "ready": False}, EXIT_FAILED, "Not ready. no map"),
        ("objects", "GET /v1/objects", OBJECTS, EXIT_OK, "3f9a12c4"),
        ("objects", "GET /v1/objects", {"objects": []}, EXIT_OK, "Nothing was found on this map"),
        (
            "objects forget 3f9a12c4",
            "DELETE /v1/objects/3f9a12c4",
            OBJECTS["objects"][0],
            EXIT_OK,
            "with the id 3f9a12c4",
        ),
        ("map list", "GET /v1/maps", {"maps": [SAVED]}, EXIT_OK, "flat 2026-09-21 13:33:20 81 9"),
        ("map list", "GET /v1/maps", {"maps": []}, EXIT_OK, "No map was saved yet"),
        ("map delete flat", "DELETE /v1/maps/flat", SAVED, EXIT_OK, "Deleted flat, saved 2026-09"),
        ("map info", "GET /v1/map", INFO, EXIT_OK, "4.0 x 6.0 m"),
        ("map save flat", "PUT /v1/maps/flat", CHANGE, EXIT_OK, f"Saved {CHANGED}"),
        ("map load flat", "POST /v1/maps/flat/load", CHANGE, EXIT_OK, f"Loaded {CHANGED}"),
        ("map clear", "POST /v1/map/clear", CHANGE, EXIT_OK, f"Cleared {CHANGED}"),
    ],
)
def test_a_reply_is_printed_is_json_and_decides_the_exit_code(
    command: str, request_line: str, reply: dict[str, Any], code: int, printed: str
) -> None:
    method, path = request_line.split()
    with fake_gateway({(method, path): (200, reply)}) as url:
        plain = RUNNER.invoke(app, [*command.split(), "--url", url])
        as_json = RUNNER.invoke(app, [*command.split(), "--url", url, "--json"])
    assert (plain.exit_code, as_json.exit_code) == (code, code)
    text = " ".join(re.sub("[│┃]", " ", plain.stdout).split())
    assert " ".join(printed.split()) in text
    assert as_json.stderr == plain.stdout
    assert json.loads(as_json.stdout) == reply


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        ("query sofa --area 1,2,3", "x_min,y_min,x_max,y_max in metres"),
        ("query sofa --area a,b,c,d", "x_min,y_min,x_max,y_max in metres"),
        ("query", "name an object, or give --image"),
        ("query sofa --image crop.png", "name an object, or give --image"),
        ("query --not bed --image crop.png", "name an object, or give --image"),
        ("query --image crop.gif", "crop.gif: the image is no PNG and no JPEG"),
        ("query --image none.png", "none.png: No such file"),
        ("search sofa --max-distance 0", "max_distance_m is 0.0: a limit must be positive"),
    ],
)
def test_what_cannot_be_asked_is_a_usage_error(
    command: str, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "crop.png").write_bytes(PNG)
    (tmp_path / "crop.gif").write_bytes(b"GIF89a")
    result = RUNNER.invoke(app, [*command.split(), "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert sentence in error_of(result)["error"]


def test_an_image_is_asked_for_in_the_place_of_a_text(tmp_path: Path) -> None:
    router, crop = MemoryRouter(), tmp_path / "crop.png"
    mapper = FakeMapper(router)
    crop.write_bytes(PNG)
    worker = build(router.bus("gateway"), GatewayConfig(port=0))
    url = f"http://127.0.0.1:{worker.port}"
    result = RUNNER.invoke(app, ["query", "--image", str(crop), "--url", url, "--json"])
    worker.close()
    assert result.exit_code == EXIT_OK
    assert mapper.images == [PNG]
    assert json.loads(result.stdout.splitlines()[-1])["calibrated"] is False
    mapper.bus.close()


@pytest.mark.parametrize("command", REQUESTS)
def test_without_a_gateway_there_is_one_sentence(command: str) -> None:
    result = RUNNER.invoke(app, [*command.split(), "--url", "http://127.0.0.1:9", "--json"])
    assert result.exit_code == EXIT_FAILED
    assert len(result.stderr.splitlines()) == 1
    assert error_of(result)["error"].startswith("No gateway at ")


def test_where_units_are_installed_systemd_starts_everything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "onemap.target").touch()
    monkeypatch.setattr(gateway, "UNITS", (tmp_path,))
    result = RUNNER.invoke(app, ["status", "--url", "http://127.0.0.1:9", "--json"])
    assert "start everything with 'sudo systemctl start onemap" in error_of(result)["error"]


@pytest.mark.parametrize(
    ("status", "code"),
    [(422, EXIT_USAGE_ERROR), (400, EXIT_USAGE_ERROR), (404, EXIT_FAILED), (503, EXIT_FAILED)],
)
def test_a_refusal_is_a_usage_error_only_if_the_request_is_wrong(status: int, code: int) -> None:
    refusal = {"detail": "There is no word 'sofax'."}
    with fake_gateway({("POST", "/v1/queries"): (status, refusal)}) as url:
        result = RUNNER.invoke(app, ["query", "sofax", "--url", url, "--json"])
    assert result.exit_code == code
    assert error_of(result)["error"] == refusal["detail"]


@pytest.mark.parametrize(
    ("option", "value", "named"),
    [
        *(("--url", u, repr(u)) for u in ("robot", "", "http://[::1", "ftp://x")),
        ("--token", "schlüssel", "token"),
    ],
)
def test_what_cannot_be_an_address_or_a_token_is_a_usage_error(
    option: str, value: str, named: str
) -> None:
    result = RUNNER.invoke(app, ["status", option, value, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert named in error_of(result)["error"]


@pytest.mark.parametrize("command", [["doctor"], ["status", "--service", "mapper"]], ids=" ".join)
def test_without_a_router_there_is_one_sentence(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_tools.doctor.CONNECT_S", 0.3)
    monkeypatch.setattr("onemap_tools.processes.session.CONNECT_S", 0.3)
    config = tmp_path / "robot.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{any_free_port()}]}}\n")
    result = RUNNER.invoke(app, [*command, "--config", str(config)])
    assert result.exit_code == EXIT_FAILED
    assert "No router at tcp/127.0.0.1:" in result.stderr


LIVE = {"streams": [{"name": "revision", "age_s": 0.25, "rate_hz": 5.0}]}
DRIVE = {**ARRIVED, "state": "approaching", "reason": "driving to the place"}


def report(state: str, *results: dict[str, Any]) -> dict[str, Any]:
    return {**SEARCH, "state": state, "target": "sofa", "results": list(results)}


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
        report("exploring"), report("approaching"), 503, 503, report("found", RESULT), status=LIVE
    )
    start = partial(gateway.client.search, ("sofa", "bed"))
    final, exit_code = follow(gateway.client, start, console)
    assert (final["results"], exit_code) == ([RESULT], 0)
    assert gateway.sent[0] == {"objects": ["sofa", "bed"]}
    for part in ("sofa: approaching", "The planner is not running.", "map 0.2 s old, 5.0 updates"):
        assert part in text_of(console)
    away = Gateway(report("exploring"), 503)  # for ever
    with pytest.raises(OneMapError, match="The planner is not running"):
        follow(away.client, partial(away.client.search, "sofa"), console)


def test_a_gateway_that_is_away_is_told_now_and_then_until_it_is_back(
    console: Console, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, passed_s = [0], itertools.count(step=0.5)

    def handle(request: httpx.Request) -> httpx.Response:
        if request.method == "GET" and request.url.path != "/v1/status":
            asked[0] += 1
            if asked[0] < 16:
                raise httpx.ConnectError("refused", request=request)
        return httpx.Response(200, json=report("found" if asked[0] else "exploring", RESULT))

    monkeypatch.setattr(remote, "time", SimpleNamespace(monotonic=lambda: next(passed_s)))
    client = Client(transport=httpx.MockTransport(handle))
    assert follow(client, partial(client.search, "sofa"), console)[1] == 0
    told = [line for line in text_of(console).splitlines() if "does not answer" in line]
    assert 2 <= len(told) <= 3
    assert told[0].endswith(
        "The gateway does not answer: attempt 1 of 20, the search itself goes on."
    )


def test_ctrl_c_ends_what_waits_for_an_answer(console: Console) -> None:
    asked: list[str] = []

    def handle(request: httpx.Request) -> httpx.Response:
        asked.append(request.method)
        if request.method == "GET":
            os.kill(os.getpid(), signal.SIGINT)
            raise AssertionError("it went on")
        return httpx.Response(200, json=report("cancelled" if len(asked) > 1 else "exploring"))

    client = Client(transport=httpx.MockTransport(handle))
    assert follow(client, partial(client.search, "sofa"), console)[1] == 130
    assert asked == ["POST", "GET", "DELETE"]


@pytest.mark.parametrize("arrives", [True, False])
def test_ctrl_c_asks_again_until_the_stop_is_confirmed(
    console: Console, monkeypatch: pytest.MonkeyPatch, arrives: bool
) -> None:
    monkeypatch.setattr("onemap.connection.STOP_PAUSE_S", 0.0)
    monkeypatch.setattr("onemap.connection.STOP_PATIENCE_S", 60.0 if arrives else 0.0)
    stops: list[str] = []

    def handle(request: httpx.Request) -> httpx.Response:
        if request.method == "DELETE":
            stops.append(request.url.path)
            if len(stops) == 1 or not arrives:
                raise httpx.ReadTimeout("lost", request=request)
            if len(stops) == 2:
                return httpx.Response(503, json={"detail": "The planner is not running."})
            return httpx.Response(200, json=report("cancelled"))
        if request.method == "POST":
            os.kill(os.getpid(), signal.SIGINT)  # handled before the next wait
        return httpx.Response(200, json=report("exploring"))

    client = Client(transport=httpx.MockTransport(handle))
    start = partial(client.search, "sofa")
    if arrives:
        assert follow(client, start, console)[1] == 130
        assert len(stops) == 3
        assert "Not stopped yet, trying again" in text_of(console)
        assert "The planner is not running." in text_of(console)
    else:
        with pytest.raises(OneMapError, match="The robot may still drive: no stop was confirmed"):
            follow(client, start, console)


@pytest.mark.parametrize(
    "status", [None, {"streams": []}, {"streams": [{**LIVE["streams"][0], "age_s": None}]}]
)
def test_unknown_map_updates_are_left_out_of_a_drive(status: Any, console: Console) -> None:
    gateway = Gateway(DRIVE, {**DRIVE, "state": "arrived"}, status=status)
    final, exit_code = follow(gateway.client, lambda: gateway.client.go_to(1.0, -2.5), console)
    assert (exit_code, is_done(final), is_done(DRIVE)) == (0, True, False)
    assert gateway.sent[0] == {"go_to_m": [1.0, -2.5]}
    assert (
        text_of(console)
        .rstrip()
        .endswith("search: approaching: driving to the place; robot drove 3.5 m")
    )


def test_an_interrupted_search_is_asked_for_again_while_the_command_lives(
    console: Console,
) -> None:
    interrupted, found = report("interrupted"), report("found", RESULT)
    gateway = Gateway(report("exploring"), interrupted, 503, report("exploring"), found)
    start = partial(gateway.client.search, "bed")
    assert follow(gateway.client, start, console, again=True) == (found, 0)
    gateway = Gateway(report("exploring"), interrupted)
    start = partial(gateway.client.search, "bed")
    assert follow(gateway.client, start, console) == (interrupted, 1)


def test_ctrl_c_stops_a_search_that_went_on_though_the_answer_was_lost(console: Console) -> None:
    stops: list[str] = []

    def handle(request: httpx.Request) -> httpx.Response:
        if request.url.path.endswith("/again"):
            os.kill(os.getpid(), signal.SIGINT)
            raise httpx.ReadTimeout("lost", request=request)
        if request.method == "DELETE":
            stops.append(request.url.path)
            return httpx.Response(200, json=report("cancelled"))
        return httpx.Response(200, json=report("interrupted"))

    client = Client(transport=httpx.MockTransport(handle))
    assert follow(client, partial(client.search, "sofa"), console, again=True)[1] == 130
    assert stops == ["/v1/searches/current"]  # the new one has no name here


def test_only_an_interrupted_search_is_offered_again() -> None:
    assert remote.again(report("interrupted", RESULT)).endswith("'onemap search --again'.")
    assert remote.again(report("cancelled", RESULT)) == ""


def test_a_query_says_its_verdict_and_where_it_is(console: Console) -> None:
    remote.describe_query(FOUND, console)
    remote.describe_query(ABSENT, console)
    said = " ".join(text_of(console).split())
    for part in (
        "Understood as: sofa, anywhere.",
        "'sofa' is in the living room, next to the desk, at (2.35, -1.10) m.",
        "Its photograph: GET /v1/objects/3f9a12c4.jpg",
        "00:00:12",
        "0.1 to 0.9 m",
        "was not seen, but only 62 % of the reachable area was looked at",
    ):
        assert part in said
