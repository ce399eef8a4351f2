"""Commands that run the demo, the router and the services."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_USAGE_ERROR
from tests.tools.cli.commands import error_of

RUNNER = CliRunner()


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, tuple[str, ...]]]:
    """Name and arguments of every service that is run; each exits with 7 at once."""
    started: list[tuple[str, tuple[str, ...]]] = []

    def run(name: str, arguments: tuple[str, ...]) -> int:
        started.append((name, arguments))
        return 7

    monkeypatch.setattr("onemap_tools.processes.services.run", run)
    return started


def test_a_service_runs_with_its_configuration(
    started: list[tuple[str, tuple[str, ...]]],
) -> None:
    assert RUNNER.invoke(app, ["mapper", "--config", "robot.yaml"]).exit_code == 7
    assert RUNNER.invoke(app, ["planner"]).exit_code == 7
    assert started == [("mapper", ("--config", "robot.yaml")), ("planner", ())]


def test_the_recording_of_replay_is_an_argument(
    started: list[tuple[str, tuple[str, ...]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ONEMAP__REPLAY__DIRECTORY", "another")
    assert RUNNER.invoke(app, ["replay", str(tmp_path)]).exit_code == 7
    assert json.loads(os.environ["ONEMAP__REPLAY__DIRECTORY"]) == str(tmp_path)
    assert started == [("replay", ())]


@pytest.mark.parametrize(
    "arguments",
    [
        ["demo", "--seed", "-1"],
        ["demo", "--scene", "/no/such/file.glb"],
        ["demo", "--time-limit", "soon"],
        ["query"],
        ["search"],
        ["status", "--url", "robot"],
        ["status", "--service", "maper"],
        ["bench", "fusion", "--frames", "0"],
        ["bench", "fusion", "--frames", "many"],
        ["up", "--only", "maper"],
        ["up", "--config", "/no/such/file.yaml"],
        ["router", "--config", "/no/such/file.yaml"],
        ["router", "--zenoh-config", "/no/such/file.json5"],
        ["planner", "--config", "/no/such/file.yaml"],
        ["replay", "/no/such/folder"],
        ["map", "save"],
        ["fly"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_reported_without_traceback(arguments: list[str], tmp_path: Path) -> None:
    logs = ["--logs", str(tmp_path)] if arguments[0] == "up" else []
    result = RUNNER.invoke(app, [*arguments, *logs])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr
    assert "Traceback" not in result.output


def test_a_missing_extra_is_reported_with_what_installs_it(tmp_path: Path) -> None:
    """The mapper without torch, in a process whose imports of torch fail."""
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "from onemap_tools.cli.app import main\n"
        "sys.argv = ['onemap', 'mapper']\n"
        "main()\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.returncode == EXIT_USAGE_ERROR
    assert "pip install 'onemap[mapper]'" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_demo_that_cannot_start_has_a_summary_with_the_error(tmp_path: Path) -> None:
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
