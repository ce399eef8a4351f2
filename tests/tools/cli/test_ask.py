"""Commands that ask a running robot, and what they say without one."""

from __future__ import annotations

import json
from pathlib import Path
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.reply_docs import EXAMPLES
from onemap_gateway.service import build
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
    ("query", "red", "sofa"),
    ("search", "sofa"),
    ("objects",),
    ("go", "1", "-2.5"),
    ("status",),
    ("map", "info"),
    ("map", "save", "flat"),
    ("map", "load", "flat"),
    ("map", "merge", "flat"),
    ("map", "clear"),
    ("map", "export", "flat.npz"),
)


@pytest.mark.parametrize(
    ("verdict", "code"),
    [("found", EXIT_OK), ("not_here", EXIT_FAILED), ("not_looked_yet", EXIT_FAILED)],
)
def test_the_verdict_decides_the_exit_code(verdict: str, code: int) -> None:
    (example, _) = EXAMPLES["QueryResult"]
    with fake_gateway({("POST", "/v1/queries"): (200, {**example, "verdict": verdict})}) as url:
        assert RUNNER.invoke(app, ["query", "sofa", "--url", url]).exit_code == code


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


@pytest.mark.parametrize("options", [(), ("sofa", "--image"), ("--not", "bed", "--image")])
def test_a_query_is_of_words_or_of_an_image(options: tuple[str, ...], tmp_path: Path) -> None:
    (crop := tmp_path / "crop.png").write_bytes(PNG)
    files = (str(crop),) if options else ()
    result = RUNNER.invoke(app, ["query", *options, *files, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "name an object, or give --image" in error_of(result)["error"]


@pytest.mark.parametrize("area", ["1,2,3", "a,b,c,d", "0 0 1 1"])
def test_an_area_that_is_none_is_refused(area: str) -> None:
    result = RUNNER.invoke(app, ["query", "sofa", "--area", area, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "x_min,y_min,x_max,y_max in metres" in error_of(result)["error"]


def test_objects_are_printed_and_are_json() -> None:
    (example,) = EXAMPLES["MapObject"]
    reply = {"objects": [example], "left_out": 3}
    with fake_gateway({("GET", "/v1/objects"): (200, reply)}) as url:
        result = RUNNER.invoke(app, ["objects", "--url", url, "--json"])
        plain = RUNNER.invoke(app, ["objects", "--url", url])
    assert (result.exit_code, plain.exit_code) == (EXIT_OK, EXIT_OK)
    assert json.loads(result.stdout.splitlines()[-1]) == {"objects": [example]}
    assert "3f9a12c4" in plain.stdout


@pytest.mark.parametrize("command", REQUESTS, ids=" ".join)
def test_without_a_gateway_there_is_one_sentence(command: tuple[str, ...]) -> None:
    url = f"http://127.0.0.1:{any_free_port()}"
    plain = RUNNER.invoke(app, [*command, "--url", url])
    assert plain.exit_code == EXIT_FAILED
    assert len(plain.stderr.splitlines()) == 1
    assert plain.stdout == ""
    result = RUNNER.invoke(app, [*command, "--url", url, "--json"])
    assert result.exit_code == EXIT_FAILED
    assert error_of(result)["error"].startswith("No gateway at ")


@pytest.mark.parametrize(("ready", "code"), [(True, EXIT_OK), (False, EXIT_FAILED)])
def test_status_exits_with_0_only_if_a_search_could_start(ready: bool, code: int) -> None:
    status = {"ready": ready, "problem": "no map", "services": [], "streams": []}
    with fake_gateway({("GET", "/v1/status"): (200, status)}) as url:
        result = RUNNER.invoke(app, ["status", "--url", url, "--json"])
    assert result.exit_code == code
    assert json.loads(result.stdout) == status


@pytest.mark.parametrize(
    ("status", "code"),
    [  # an unknown word, a name with a slash: the request is wrong
        *((status, EXIT_USAGE_ERROR) for status in (400, 413, 415, 422)),
        *((status, EXIT_FAILED) for status in (401, 403, 404, 409, 503, 507)),
    ],
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
        *(("--url", u, repr(u)) for u in ("robot", "", "http://[::1", "http://a b", "ftp://x")),
        ("--token", "schlüssel", "token"),
        ("--token", "a\nb", "token"),
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


def test_a_search_exits_with_0_only_if_all_were_found() -> None:
    result = {
        "name": "sofa",
        "outcome": "found",
        "reason": "confirmed",
        "position_m": [1.0, 2.0, 0.5],
        "duration_s": 3.0,
        "path_length_m": 1.0,
    }
    report = {"id": "s1", "state": "found", "objects": ["sofa"], "results": [result], "reason": ""}
    with fake_gateway({("POST", "/v1/searches"): (201, report)}) as url:
        done = RUNNER.invoke(app, ["search", "sofa", "--any-order", "--url", url, "--json"])
        limited = RUNNER.invoke(app, ["search", "sofa", "--url", url, "--max-distance", "0"])
    assert limited.exit_code == EXIT_USAGE_ERROR
    assert "max_distance_m is 0.0: a limit must be positive" in limited.stderr
    assert done.exit_code == EXIT_OK
    assert json.loads(done.stdout) == report


@pytest.mark.parametrize(("state", "code"), [("arrived", EXIT_OK), ("failed", EXIT_FAILED)])
@pytest.mark.parametrize("place", [("-1.2", "-3"), ("--", "-1.2", "-3")], ids=" ".join)
def test_go_exits_with_0_only_if_the_robot_arrived(
    state: str, code: int, place: tuple[str, ...]
) -> None:
    report = {
        "id": "s1",
        "state": state,
        "objects": [],
        "target": "",
        "reason": "standing 0.05 m from the place (-1.20, -3.00)",
        "results": [],
        "elapsed_s": 12.0,
        "path_length_m": 3.5,
    }
    with fake_gateway({("POST", "/v1/searches"): (201, report)}) as url:
        result = RUNNER.invoke(app, ["go", "--url", url, "--json", *place])
        plain = RUNNER.invoke(app, ["go", "--url", url, *place])
    assert (result.exit_code, plain.exit_code) == (code, code)
    assert json.loads(result.stdout.splitlines()[-1]) == report
    assert plain.stdout == (
        f"{state.capitalize()}: standing 0.05 m from the place (-1.20, -3.00) (12 s, 3.5 m).\n"
    )
