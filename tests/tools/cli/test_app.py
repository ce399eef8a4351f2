"""The command line: help, misuse, and a robot that is not there."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_shared.services import SERVICES
from onemap_tools.cli.app import app
from onemap_tools.client import GatewayClient
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.processes.network import any_free_port

RUNNER = CliRunner()
COMMANDS = (
    ["demo"],
    ["up"],
    ["router"],
    *([name] for name in SERVICES),
    ["query"],
    ["search"],
    ["status"],
    ["doctor"],
    ["map"],
    *(["map", name] for name in ("save", "load", "info", "export", "clear")),
    ["scene"],
    ["scene", "check"],
    ["bench"],
    ["bench", "fusion"],
    ["train"],
    ["train", "mini"],
)
ASKING = (
    ["query", "red", "sofa"],
    ["search", "sofa"],
    ["status"],
    ["map", "info"],
    ["map", "save", "flat"],
    ["map", "load", "flat"],
    ["map", "clear"],
    ["map", "export", "flat.npz"],
)


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_command_explains_itself(command: list[str]) -> None:
    result = RUNNER.invoke(app, [*command, "--help"])
    assert result.exit_code == EXIT_OK
    assert "usage: " in result.output.lower()


def test_a_query_without_an_answer_exits_with_no(monkeypatch: pytest.MonkeyPatch) -> None:
    reply = {"text": "yeti", "regions": [], "message": "Nothing on the map looks like 'yeti'."}
    monkeypatch.setattr(GatewayClient, "query", lambda self, text, regions: reply)
    result = RUNNER.invoke(app, ["query", "yeti", "--json"])
    assert result.exit_code == EXIT_FAILED
    assert json.loads(result.stdout.splitlines()[-1]) == reply
    assert RUNNER.invoke(app, ["query", "yeti"]).stdout.strip() == reply["message"]


@pytest.mark.parametrize("command", ASKING, ids=" ".join)
def test_no_gateway_is_one_sentence(command: list[str]) -> None:
    result = RUNNER.invoke(app, [*command, "--url", f"http://127.0.0.1:{any_free_port()}"])
    assert result.exit_code == EXIT_FAILED
    assert result.stderr.startswith("No gateway at http://127.0.0.1:")
    assert len(result.stderr.splitlines()) == 1
    assert result.stdout == ""


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
def test_misuse_is_told_without_traceback(arguments: list[str], tmp_path: Path) -> None:
    logs = ["--logs", str(tmp_path)] if arguments[0] == "up" else []
    result = RUNNER.invoke(app, [*arguments, *logs])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr
    assert "Traceback" not in result.output


def test_an_unknown_key_is_told_with_the_nearest_name(tmp_path: Path) -> None:
    config = tmp_path / "robot.yaml"
    config.write_text("bus: {conect: [tcp/127.0.0.1:7447]}\n")
    result = RUNNER.invoke(app, ["doctor", "--config", str(config)])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "did you mean 'connect'" in result.stderr


@pytest.mark.parametrize("command", [["doctor"], ["status", "--service", "mapper"]], ids=" ".join)
def test_no_router_is_one_sentence(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_tools.doctor.report.JOIN_S", 0.3)
    monkeypatch.setattr("onemap_tools.processes.heartbeat.JOIN_S", 0.3)
    config = tmp_path / "robot.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{any_free_port()}]}}\n")
    result = RUNNER.invoke(app, [*command, "--config", str(config)])
    assert result.exit_code == EXIT_FAILED
    assert "No router at tcp/127.0.0.1:" in result.stderr


def test_a_missing_extra_is_told_with_what_installs_it(tmp_path: Path) -> None:
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


def test_the_command_starts_without_what_it_does_not_need() -> None:
    """Heavy libraries are imported by the commands that need them."""
    code = (
        "import sys; import onemap_tools.cli.app\n"
        "heavy = {'torch', 'cv2', 'zenoh', 'fastapi', 'httpx', 'numpy', 'onnxruntime'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert result.stdout.strip() == "[]"


@pytest.mark.slow
def test_a_demo_that_cannot_start_ends_with_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scene is none: the demo says so, and starts nothing."""
    scene = tmp_path / "flat.glb"
    scene.write_bytes(b"this is no scene")
    arguments = ["demo", "--headless", "--json", "--scene", str(scene), "--out", str(tmp_path)]
    result = RUNNER.invoke(app, [*arguments, "--time-limit", "60"])
    assert result.exit_code == EXIT_USAGE_ERROR
    document = json.loads(result.stdout.splitlines()[-1])
    assert document["worked"] is False
    assert document["trouble"] == document["error"]
    assert "onemap scene check" in document["error"]
    assert not Path(document["folder"]).exists()
