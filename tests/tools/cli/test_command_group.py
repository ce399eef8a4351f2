"""Exit codes and JSON errors of every command."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.cli.command_group import wants_json
from onemap_tools.errors import EXIT_INTERRUPTED, EXIT_USAGE_ERROR
from onemap_tools.processes.launch import onemap_command
from tests.tools.cli.commands import COMMANDS, error_of

RUNNER = CliRunner()


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_an_unknown_option_is_a_usage_error_in_json(command: tuple[str, ...]) -> None:
    result = RUNNER.invoke(app, [*command, "--no-such-option", "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert len(result.stdout.splitlines()) == 1
    error_of(result)


@pytest.mark.parametrize("words", [["fly"], ["map", "fly"], ["--fly"], []], ids=" ".join)
def test_an_unknown_command_is_a_usage_error_in_json(words: list[str]) -> None:
    result = RUNNER.invoke(app, [*words, "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    error_of(result)


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_missing_configuration_is_a_usage_error(command: tuple[str, ...]) -> None:
    """Of those that take one; the others refuse the option."""
    service = ["--service", "mapper"] if command == ("status",) else []  # which alone reads it
    result = RUNNER.invoke(app, [*command, *service, "--config", "/no/such.yaml", "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR


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
def test_other_usage_errors_are_one_object_too(arguments: list[str]) -> None:
    extra = [] if arguments[0] in ("up", "router") else ["--json"]
    result = RUNNER.invoke(app, [*arguments, *extra])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "Traceback" not in result.output
    if extra:
        error_of(result)


def test_words_after_two_dashes_are_not_options() -> None:
    assert wants_json(["search", "--json", "--", "sofa"])
    assert not wants_json(["search", "--", "--json"])


@pytest.mark.slow
def test_ctrl_c_exits_with_130_and_json(tmp_path: Path) -> None:
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
        stdout, stderr = process.communicate(timeout=90)
    assert process.returncode == EXIT_INTERRUPTED
    assert json.loads(stdout) == {"error": "Stopped.", "exit_code": EXIT_INTERRUPTED}
    assert b"Traceback" not in stderr
