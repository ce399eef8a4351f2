"""The router command, with the real router where it cannot listen or no longer routes."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from onemap_shared.config import ConfigError
from onemap_tools.errors import EXIT_FAILED, CliError
from onemap_tools.processes import router
from onemap_tools.processes.network import any_free_port


@pytest.fixture(autouse=True)
def _no_logging(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(router, "set_up_logging", lambda *_: None)


def test_it_listens_as_told_or_where_the_services_connect(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls: list[Any] = []

    def run_router(endpoints: Any, _stop: Any, file: Any, routed: Any, *, namespace: str) -> None:
        routed()
        calls.append((endpoints, file, namespace))

    monkeypatch.setattr(router, "watch_parent", lambda _: None)
    monkeypatch.setattr(router, "run_router", run_router)
    config, file = tmp_path / "robot.yaml", tmp_path / "router.json5"
    config.write_text("bus: {connect: [tcp/127.0.0.1:7001], namespace: fleet}\n")
    file.write_text("{}")
    told = ("tcp/127.0.0.1:7002",)
    router.run(config, (), None)
    router.run(config, told, None)
    router.run(None, (), file)  # which has endpoints of its own
    router.run(None, told, file)
    assert calls == [
        (("tcp/127.0.0.1:7001",), None, "fleet"),
        (told, None, "fleet"),
        ((), file, ""),
        (told, file, ""),
    ]
    with pytest.raises(ConfigError, match="no such file"):
        router.run(None, (), tmp_path / "nowhere.json5")


def test_a_taken_port_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(CliError, match=f"{router.CANNOT_LISTEN} on {endpoint}") as error:
            router.run(None, (endpoint,), None)
    assert error.value.exit_code == EXIT_FAILED


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('{\n  listen: { endpoint: ["tcp/127.0.0.1:1"] },\n}', "line 2, column 13: unknown field"),
        ('{ mode: "router"', "line 1, column 9: expected"),
    ],
)
def test_a_wrong_file_is_named_with_the_line(tmp_path: Path, text: str, sentence: str) -> None:
    """Not as a port that is taken; exit code 2, so that no supervisor tries it again."""
    file = tmp_path / "router.json5"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=sentence) as error:
        router.run(None, (), file)
    assert str(file) in str(error.value)


def test_a_router_that_no_longer_routes_ends() -> None:
    code = (
        "import sys\n"
        "from onemap_shared import bus, watchdog\n"
        "from onemap_tools.processes import router\n"
        "watchdog.HANG_LIMIT_S = 0.3\n"
        "bus._answers = lambda *_: False\n"
        "router.run(None, (sys.argv[1],), None)\n"
    )
    command = [sys.executable, "-c", code, f"tcp/127.0.0.1:{any_free_port()}"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 1
    assert "router ends, to be restarted: its main loop has made no progress" in result.stderr
