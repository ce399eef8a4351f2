"""The router command, with the real router where it cannot listen."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from onemap_shared.config import ConfigError
from onemap_tools.errors import EXIT_FAILED, CliError
from onemap_tools.processes import router
from onemap_tools.processes.network import any_free_port

Calls = list[tuple[tuple[str, ...], Path | None]]


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    """Endpoints and file of every router that is run; none of them routes."""
    calls: Calls = []
    monkeypatch.setattr(router, "set_up_logging", lambda *_: None)
    monkeypatch.setattr(router, "watch_parent", lambda _: None)

    def run_router(
        endpoints: tuple[str, ...],
        _stop: object,
        file: Path | None,
        routed: Callable[[], None],
        *,
        namespace: str,
    ) -> None:
        assert namespace == ""
        routed()
        calls.append((endpoints, file))

    monkeypatch.setattr(router, "run_router", run_router)
    return calls


def test_it_listens_where_the_services_connect(calls: Calls, tmp_path: Path) -> None:
    config = tmp_path / "robot.yaml"
    config.write_text("bus: {connect: [tcp/127.0.0.1:7001]}\n")
    router.run(config, (), None)
    router.run(config, ("tcp/127.0.0.1:7002",), None)
    assert calls == [(("tcp/127.0.0.1:7001",), None), (("tcp/127.0.0.1:7002",), None)]


def test_a_zenoh_file_has_endpoints_of_its_own(calls: Calls, tmp_path: Path) -> None:
    file = tmp_path / "router.json5"
    file.write_text("{}")
    router.run(None, (), file)
    router.run(None, ("tcp/127.0.0.1:7002",), file)
    assert calls == [((), file), (("tcp/127.0.0.1:7002",), file)]
    with pytest.raises(ConfigError, match="no such file"):
        router.run(None, (), tmp_path / "nowhere.json5")


def test_a_taken_port_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(router, "set_up_logging", lambda *_: None)
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(CliError, match=f"{router.CANNOT_LISTEN} on {endpoint}") as error:
            router.run(None, (endpoint,), None)
    assert error.value.exit_code == EXIT_FAILED


def test_a_router_that_no_longer_routes_ends() -> None:
    code = (
        "import sys\n"
        "from onemap_shared import bus, watchdog\n"
        "from onemap_tools.processes import router\n"
        "watchdog.HANG_LIMIT_S = 1.0\n"
        "bus._answers = lambda *_: False\n"
        "router.run(None, (sys.argv[1],), None)\n"
    )
    command = [sys.executable, "-c", code, f"tcp/127.0.0.1:{any_free_port()}"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 1
    assert "router ends, to be restarted: its main loop has made no progress" in result.stderr
