"""Commands that ask a running robot or its map, and what they say without one."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.reply_docs import EXAMPLES
from onemap_gateway.service import build
from onemap_ros2 import discovery
from onemap_ros2.topic_list import TopicReport
from onemap_shared.messages import Heartbeat
from onemap_shared.transport import Bus
from onemap_tools.cli.app import app
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
    "go 1 -2.5",
    "status",
    "map info",
    "map merge flat",
    "map export flat.npz",
)
RESULT = {
    "name": "sofa",
    "outcome": "found",
    "reason": "confirmed",
    "position_m": [1.0, 2.0, 0.5],
    "duration_s": 30.0,
    "path_length_m": 7.5,
}
SEARCH = {
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
OBJECTS = {"objects": [EXAMPLES["MapObject"][0]]}
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
CHANGED = "flat.npz: 81 cells from 9 frames, 2.5 MB.\n"
FOUND, ABSENT = EXAMPLES["QueryResult"]
WENT = "standing 0.05 m from the place (-1.20, -3.00) (12 s, 3.5 m).\n"


@pytest.mark.parametrize(
    ("command", "request_line", "reply", "code", "printed"),
    [
        ("query sofa", "POST /v1/queries", FOUND, EXIT_OK, "'sofa' is at"),
        ("query sofa", "POST /v1/queries", ABSENT, EXIT_FAILED, "was not seen"),
        ("search sofa", "POST /v1/searches", SEARCH, EXIT_OK, "7.5 m confirmed"),
        ("search sofa", "POST /v1/searches", MISSED, EXIT_FAILED, "searched all rooms\n"),
        ("go -1.2 -3", "POST /v1/searches", ARRIVED, EXIT_OK, f"Arrived: {WENT}"),
        ("go -1.2 -3", "POST /v1/searches", {**ARRIVED, "state": "failed"}, EXIT_FAILED, WENT),
        ("status", "GET /v1/status", STATUS, EXIT_OK, "mapper down It is [not] running."),
        ("status", "GET /v1/status", STATUS, EXIT_OK, "rgbd never 0.0 Hz 0 7 1"),
        ("status", "GET /v1/status", {**STATUS, "ready": False}, EXIT_FAILED, "Not ready. no map"),
        ("objects", "GET /v1/objects", OBJECTS, EXIT_OK, "3f9a12c4"),
        ("objects", "GET /v1/objects", {"objects": []}, EXIT_OK, "Nothing was found on this map"),
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
        ("search sofa --max-distance 0", "max_distance_m is 0.0: a limit must be positive"),
    ],
)
def test_what_cannot_be_asked_is_a_usage_error(
    command: str, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "crop.png").write_bytes(PNG)
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


class Session:
    """Stands in for the bus of a command."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    def __call__(self, *_: object) -> Session:
        return self

    def __enter__(self) -> Bus:
        return self._bus

    def __exit__(self, *_: object) -> None:
        return


@pytest.mark.parametrize(("ready", "code"), [(True, EXIT_OK), (False, EXIT_FAILED)])
def test_the_status_of_one_service_is_its_heartbeat(
    ready: bool, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    router = MemoryRouter()
    beats = Mock(take=lambda _: Heartbeat("mapper", "a", 1, 1, ready, "no frames"))
    bus = Mock(wraps=router.bus(), subscribe=lambda *_: beats)
    monkeypatch.setattr("onemap_tools.processes.session.temporary_session", Session(bus))
    monkeypatch.setattr("onemap_tools.processes.session.PATIENCE_S", 0.05)
    result = RUNNER.invoke(app, ["status", "--service", "mapper", "--json"])
    assert result.exit_code == code
    document = json.loads(result.stdout)
    expected = {"service": "mapper", "ready": True} if ready else {"exit_code": code}
    assert document.items() >= expected.items()
    assert ready or "no frames" in document["error"]


def test_the_doctor_fails_if_there_are_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_tools.doctor.temporary_session", Session(MemoryRouter().bus()))
    monkeypatch.setattr("onemap_tools.doctor.LISTEN_S", 0.01)
    result = RUNNER.invoke(app, ["doctor", "--json"])
    assert result.exit_code == EXIT_FAILED
    document = json.loads(result.stdout)
    assert document["healthy"] is False
    sentences = [finding["sentence"] for finding in document["findings"]]
    assert "The mapper is not running." in sentences


ODOM = TopicReport("/odom", "nav_msgs/msg/Odometry", 1, 2, 19.96, "odometry")
OTHER = TopicReport("/chatter", "std_msgs/msg/String", 0, 1, None, "")


@pytest.mark.parametrize(("missing", "code"), [([], 0), (["no node publishes /a"], 1)])
def test_topics_are_listed(monkeypatch: pytest.MonkeyPatch, missing: list[str], code: int) -> None:
    monkeypatch.setattr(discovery, "survey", lambda *_: ([ODOM, OTHER], missing))
    plain = RUNNER.invoke(app, ["ros2", "topics"])
    assert plain.exit_code == code
    assert "20.0 Hz  <- odometry" in plain.stdout
    assert ("missing: no node publishes /a" in plain.stdout) == bool(missing)
    as_json = RUNNER.invoke(app, ["ros2", "topics", "--json"])
    document = json.loads(as_json.stdout.splitlines()[-1])
    assert document["missing"] == missing
    assert document["topics"][0]["rate_hz"] == 19.96


def test_a_robot_that_cannot_be_reached_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise ConnectionError("no ROS 2 router answers at tcp/r")

    monkeypatch.setattr(discovery, "survey", refuse)
    result = RUNNER.invoke(app, ["ros2", "topics"])
    assert result.exit_code == 1
    assert result.stderr.strip() == "no ROS 2 router answers at tcp/r."
