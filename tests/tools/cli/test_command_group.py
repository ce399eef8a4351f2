"""Exit codes and the JSON object of every command: 0 yes, 1 no, 2 misused, 130 stopped."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.cli.command_group import wants_json
from onemap_tools.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import any_free_port
from tests.tools.fake_gateway import fake_gateway

RUNNER = CliRunner()


def commands(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The words of every command."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*path, name))
        else:
            yield (*path, name)


ALL = sorted(commands(typer.main.get_command(app)))
ASKING = (
    ("query", "sofa"),
    ("search", "sofa"),
    ("status",),
    ("map", "info"),
    ("map", "save", "flat"),
    ("map", "load", "flat"),
    ("map", "clear"),
    ("map", "export", "flat.npz"),
)


def error_of(result: Any) -> dict[str, Any]:
    """The error object, and that stderr says the same."""
    document: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    assert document["exit_code"] == result.exit_code
    assert document["error"]
    assert result.stderr
    assert "Traceback" not in result.output
    return document


@pytest.mark.parametrize("command", ALL, ids=" ".join)
def test_a_wrong_option_is_misuse_and_json(command: tuple[str, ...]) -> None:
    result = RUNNER.invoke(app, [*command, "--no-such-option", "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert len(result.stdout.splitlines()) == 1
    error_of(result)


@pytest.mark.parametrize("words", [["fly"], ["map", "fly"], ["--fly"], []], ids=" ".join)
def test_a_command_that_is_none_is_misuse_and_json(words: list[str]) -> None:
    result = RUNNER.invoke(app, [*words, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    error_of(result)


@pytest.mark.parametrize("command", ALL, ids=" ".join)
def test_a_configuration_that_is_none_is_misuse(command: tuple[str, ...]) -> None:
    """Of those that take one; the others refuse the option."""
    service = ["--service", "mapper"] if command == ("status",) else []  # which alone reads it
    result = RUNNER.invoke(app, [*command, *service, "--config", "/no/such.yaml", "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR


@pytest.mark.parametrize("command", ASKING, ids=" ".join)
def test_nobody_there_is_a_no(command: tuple[str, ...]) -> None:
    url = f"http://127.0.0.1:{any_free_port()}"
    result = RUNNER.invoke(app, [*command, "--url", url, "--json"])
    assert result.exit_code == EXIT_FAILED
    assert error_of(result)["error"].startswith("No gateway at ")


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
def test_what_the_gateway_refuses_is_misuse_only_by_its_words(status: int, code: int) -> None:
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
def test_an_address_that_is_none_is_misuse(url: str) -> None:
    result = RUNNER.invoke(app, ["status", "--url", url, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert repr(url) in error_of(result)["error"]


@pytest.mark.parametrize("token", ["schlüssel", "a\nb"])
def test_a_token_that_cannot_be_sent_is_misuse(token: str) -> None:
    result = RUNNER.invoke(app, ["status", "--token", token, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "token" in error_of(result)["error"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["demo", "--out", "/proc/nowhere"],
        ["up", "--logs", "/proc/nowhere", "--only", "mapper"],
        ["bench", "fusion", "--frames", "many"],
        ["bench", "fusion", "--frames", "0"],
        ["train", "evaluate", "--work", "/no/such"],
        ["router", "--listen", "nowhere"],
        ["models", "fetch", "no/such"],
        ["status", "--service", "maper"],
    ],
    ids=" ".join,
)
def test_other_misuse_is_one_object_too(arguments: list[str]) -> None:
    extra = [] if arguments[0] in ("up", "router") else ["--json"]
    result = RUNNER.invoke(app, [*arguments, *extra])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "Traceback" not in result.output
    if extra:
        error_of(result)


def test_a_demo_that_cannot_start_is_a_summary_with_the_error(tmp_path: Path) -> None:
    scene = tmp_path / "flat.txt"
    scene.touch()
    arguments = ["demo", "--scene", str(scene), "--out", str(tmp_path / "runs"), "--json"]
    result = RUNNER.invoke(app, arguments)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert len(result.stdout.splitlines()) == 1
    document = error_of(result)
    assert document["worked"] is False
    assert document["trouble"] == document["error"]
    assert "suffix '.txt'" in document["error"]
    assert not (tmp_path / "runs").exists()  # nothing was started


def test_words_after_two_dashes_are_no_options() -> None:
    assert wants_json(["search", "--json", "--", "sofa"])
    assert not wants_json(["search", "--", "--json"])


def test_the_codes_are_in_the_help() -> None:
    told = " ".join(RUNNER.invoke(app, ["--help"]).stdout.split())
    for part in ("0 yes or done", "1 no", "2 misused", "130 stopped", "'exit_code'"):
        assert part in told


def test_the_version_is_that_of_the_package() -> None:
    result = RUNNER.invoke(app, ["--version"])
    assert result.exit_code == EXIT_OK
    assert result.stdout == f"onemap {version('onemap')}\n"


@pytest.mark.slow
def test_ctrl_c_is_130_and_json(tmp_path: Path) -> None:
    """Interrupted while it waits for a gateway that takes the request and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}"
        command = onemap_command("query", "sofa", "--url", url, "--json")
        # A suite that was started in the background ignores the signal, and so would its child.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        signal.signal(signal.SIGINT, before)
        silent.accept()
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=30)
    assert process.returncode == EXIT_INTERRUPTED
    assert json.loads(stdout) == {"error": "Stopped.", "exit_code": EXIT_INTERRUPTED}
    assert b"Traceback" not in stderr
