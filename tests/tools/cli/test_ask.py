"""Commands that ask a running robot, and what they say without one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.client import GatewayClient
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.processes.network import any_free_port
from tests.tools.cli.commands import error_of
from tests.tools.fake_gateway import fake_gateway

RUNNER = CliRunner()
REQUESTS = (
    ("query", "red", "sofa"),
    ("search", "sofa"),
    ("status",),
    ("map", "info"),
    ("map", "save", "flat"),
    ("map", "load", "flat"),
    ("map", "clear"),
    ("map", "export", "flat.npz"),
)


def test_a_query_without_a_match_exits_with_1(monkeypatch: pytest.MonkeyPatch) -> None:
    reply = {"text": "yeti", "regions": [], "message": "Nothing on the map looks like 'yeti'."}
    monkeypatch.setattr(GatewayClient, "query", lambda self, text, regions: reply)
    result = RUNNER.invoke(app, ["query", "yeti", "--json"])
    assert result.exit_code == EXIT_FAILED
    assert json.loads(result.stdout.splitlines()[-1]) == reply
    assert RUNNER.invoke(app, ["query", "yeti"]).stdout.strip() == reply["message"]


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
    [
        (400, EXIT_USAGE_ERROR),
        (413, EXIT_USAGE_ERROR),
        (415, EXIT_USAGE_ERROR),
        (422, EXIT_USAGE_ERROR),  # an unknown word, a name with a slash
        (401, EXIT_FAILED),
        (403, EXIT_FAILED),
        (404, EXIT_FAILED),
        (409, EXIT_FAILED),
        (503, EXIT_FAILED),
        (507, EXIT_FAILED),
    ],
)
def test_a_refusal_is_a_usage_error_only_if_the_request_is_wrong(status: int, code: int) -> None:
    refusal = {"detail": "There is no word 'sofax'."}
    with fake_gateway({("POST", "/v1/queries"): (status, refusal)}) as url:
        result = RUNNER.invoke(app, ["query", "sofax", "--url", url, "--json"])
    assert result.exit_code == code
    assert error_of(result)["error"] == refusal["detail"]


@pytest.mark.parametrize(
    "url",
    [
        "robot",
        "",
        "http://",
        "http://[::1",
        "http://host:99999",
        "http://a b",
        "ftp://x",
        "http://:80",
    ],
)
def test_a_wrong_url_is_a_usage_error(url: str) -> None:
    result = RUNNER.invoke(app, ["status", "--url", url, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert repr(url) in error_of(result)["error"]


@pytest.mark.parametrize("token", ["schlüssel", "a\nb"])
def test_a_token_that_cannot_be_sent_is_a_usage_error(token: str) -> None:
    result = RUNNER.invoke(app, ["status", "--token", token, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "token" in error_of(result)["error"]


def test_an_unknown_key_is_reported_with_the_nearest_name(tmp_path: Path) -> None:
    config = tmp_path / "robot.yaml"
    config.write_text("bus: {conect: [tcp/127.0.0.1:7447]}\n")
    result = RUNNER.invoke(app, ["doctor", "--config", str(config)])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "did you mean 'connect'" in result.stderr


@pytest.mark.parametrize("command", [["doctor"], ["status", "--service", "mapper"]], ids=" ".join)
def test_without_a_router_there_is_one_sentence(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_tools.doctor.report.JOIN_S", 0.3)
    monkeypatch.setattr("onemap_tools.processes.heartbeat.JOIN_S", 0.3)
    config = tmp_path / "robot.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{any_free_port()}]}}\n")
    result = RUNNER.invoke(app, [*command, "--config", str(config)])
    assert result.exit_code == EXIT_FAILED
    assert "No router at tcp/127.0.0.1:" in result.stderr
