"""The command line as a whole: help, version, exit codes, JSON errors, what its start imports."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.cli.command_group import wants_json
from onemap_tools.errors import EXIT_INTERRUPTED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.processes.launch import onemap_command
from tests.tools.cli.commands import COMMANDS, TREE, error_of

RUNNER = CliRunner()


def test_every_command_explains_itself_without_markup() -> None:
    """Typer reads its own help as markup: a bracket would vanish."""
    for path, command in TREE[1:]:
        assert command.help, path
        texts = [command.help, getattr(command, "epilog", "")]
        texts += [getattr(parameter, "help", "") for parameter in command.params]
        assert [text for text in texts if text and "[" in text] == []


def test_the_help_of_a_first_word_names_what_stands_below_it() -> None:
    for word, second in (("search", "replay"), ("places", "forget")):
        result = RUNNER.invoke(app, [word, "--help"], env={"COLUMNS": "200"})
        assert result.exit_code == EXIT_OK
        assert f"onemap {word} {second}: " in result.stdout


def test_the_version_is_that_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    assert RUNNER.invoke(app, ["--version"]).stdout == f"onemap {version('onemap')}\n"
    monkeypatch.setattr("onemap_tools.cli.options.installed_version", lambda: "")
    assert "not installed" in RUNNER.invoke(app, ["--version"]).stdout


def python(code: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_the_command_starts_without_what_it_does_not_need() -> None:
    """Heavy libraries are imported by the commands that need them."""
    result = python(
        "import sys; import onemap_tools.cli.app\n"
        "heavy = {'torch', 'cv2', 'zenoh', 'fastapi', 'httpx', 'numpy', 'onnxruntime'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    assert result.stdout.strip() == "[]"


def test_a_missing_extra_is_reported_with_what_installs_it() -> None:
    """The mapper without torch, in a process whose imports of torch fail."""
    result = python(
        "import sys; sys.modules['torch'] = None\n"
        "from onemap_tools.cli.app import main\n"
        "sys.argv = ['onemap', 'mapper']\n"
        "main()\n"
    )
    assert result.returncode == EXIT_USAGE_ERROR
    assert "pip install -e '.[mapper]'" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_an_unknown_option_is_a_usage_error_in_json(command: tuple[str, ...]) -> None:
    result = RUNNER.invoke(app, [*command, "--no-such-option", "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert len(result.stdout.splitlines()) == 1
    error_of(result)


@pytest.mark.parametrize(
    "arguments",
    [
        "",
        "fly",
        "map fly",
        "--fly",
        "demo --seed -1",
        "demo --scene /no/such/file.glb",
        "demo --time-limit soon",
        "demo --out /proc/nowhere",
        "query",
        "search",
        "go 1",
        "go 1 east",
        "go nan 1",
        "status --url robot",
        "status --service maper",
        "status --service mapper --config /no/such.yaml",
        "bench fusion --frames many",
        "replay /no/such/folder",
        "map save",
        "models use no/such",
        "doctor --config /no/such.yaml",
        "config show --config /no/such.yaml",
    ],
)
def test_wrong_usage_is_one_json_object(arguments: str) -> None:
    result = RUNNER.invoke(app, [*arguments.split(), "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    error_of(result)


@pytest.mark.parametrize(
    "arguments",
    [
        "up --only maper",
        "up --config /no/such/file.yaml",
        "up --only mapper --logs /proc/nowhere",
        "router --config /no/such/file.yaml",
        "service router --zenoh-config /no/such/file.json5",
        "router --listen nowhere",
        "planner --config /no/such/file.yaml",
        "service planner --config /no/such/file.yaml",
    ],
)
def test_wrong_usage_of_what_prints_no_json(
    arguments: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = RUNNER.invoke(app, arguments.split())
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr
    assert "Traceback" not in result.output


def test_words_after_two_dashes_are_not_options() -> None:
    assert wants_json(["search", "--json", "--", "sofa"])
    assert not wants_json(["search", "--", "--json"])


@pytest.mark.slow
def test_ctrl_c_exits_as_the_help_says() -> None:
    """Interrupted while it waits for a gateway that takes the request and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}"
        command = onemap_command("query", "sofa", "--url", url, "--json")
        # A suite that was started in the background ignores the signal, and so would its child.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        signal.signal(signal.SIGINT, before)
        connection = silent.accept()[0]
        while not connection.recv(4096).startswith(b"POST /v1/queries"):
            connection = silent.accept()[0]  # somebody else's, who had a server at this port before
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=90)
    assert process.returncode == EXIT_INTERRUPTED
    assert stdout == b'{"error": "Stopped.", "exit_code": 130}\n'
    assert b"Traceback" not in stderr


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Name and configuration of every service that is run; each exits with 7 at once."""
    started: list[Any] = []

    def run(name: str, config: Path | None) -> None:
        started.append((name, config))
        raise SystemExit(7)

    monkeypatch.setattr("onemap_tools.processes.services.run", run)
    return started


@pytest.mark.parametrize("group", [[], ["service"]], ids=["old name", "group"])
def test_a_service_runs_with_its_configuration(started: list[Any], group: list[str]) -> None:
    assert RUNNER.invoke(app, [*group, "mapper", "--config", "robot.yaml"]).exit_code == 7
    assert RUNNER.invoke(app, [*group, "planner"]).exit_code == 7
    assert started == [("mapper", Path("robot.yaml")), ("planner", None)]


def test_the_recording_of_replay_is_an_argument(
    started: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ONEMAP__REPLAY__DIRECTORY", "another")
    assert RUNNER.invoke(app, ["replay", str(tmp_path)]).exit_code == 7
    assert json.loads(os.environ["ONEMAP__REPLAY__DIRECTORY"]) == str(tmp_path)
    assert started == [("replay", None)]


def test_a_demo_that_cannot_start_has_a_summary_with_the_error(tmp_path: Path) -> None:
    scene = tmp_path / "flat.txt"
    scene.touch()
    arguments = ["demo", "--scene", str(scene), "--out", str(tmp_path / "runs"), "--json"]
    result = RUNNER.invoke(app, arguments)
    assert result.exit_code == EXIT_USAGE_ERROR
    document = error_of(result)
    assert document["worked"] is False
    assert document["trouble"] == document["error"]
    assert "suffix '.txt'" in document["error"]
    assert not (tmp_path / "runs").exists()  # nothing was started
