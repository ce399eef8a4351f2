"""``onemap up`` while services run already, as real processes on a real router."""

from __future__ import annotations

import signal
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from typer.testing import CliRunner, Result

from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import accepts_connections, any_free_port
from tests.shared.test_bus import Router, eventually, router

__all__ = ["router"]  # the fixture

pytestmark = pytest.mark.slow
PATIENCE_S = 120.0


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """``onemap up`` takes longer to start than a session on the bus."""
    monkeypatch.setattr("tests.shared.test_bus.PATIENCE_S", PATIENCE_S)


def configuration(folder: Path, endpoint: str, port: int = 0, **sections: Any) -> Path:
    path = folder / "robot.yaml"
    gateway = {"port": port or any_free_port()}
    content = {"bus": {"connect": [endpoint]}, "gateway": gateway, **sections}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def up(config: Path, logs: Path, *more: str) -> Result:
    """Run a command that is refused."""
    return CliRunner().invoke(app, ["up", "--config", str(config), "--logs", str(logs), *more])


def started(logs: Path) -> list[str]:
    return sorted(path.stem for path in logs.glob("*.log"))


@contextmanager
def session(endpoint: str, service: str, instance: str) -> Iterator[ZenohBus]:
    """A session that others see as a service."""
    bus = open_bus(BusConfig(connect=(endpoint,)), service, instance, threading.Event())
    assert bus is not None
    try:
        yield bus
    finally:
        bus.close()


@pytest.mark.parametrize(
    ("service", "instance"),
    [
        ("mapper", "m1"),
        ("robot", "my-robot"),  # examples/my_robot.py
    ],
)
def test_nothing_is_started_beside_the_same_service(
    router: Router, tmp_path: Path, service: str, instance: str
) -> None:
    config = configuration(tmp_path, router.endpoint, simulator={})
    with session(router.endpoint, service, instance):
        result = up(config, tmp_path / "logs")
    assert result.exit_code == EXIT_FAILED
    assert f"already running at the router {router.endpoint}: {service}." in result.stderr
    assert "--only" in result.stderr
    assert "Traceback" not in result.stderr
    assert started(tmp_path / "logs") == []


def test_the_first_goes_on_when_a_second_is_refused(tmp_path: Path) -> None:
    endpoint, port = f"tcp/127.0.0.1:{any_free_port()}", any_free_port()
    config = configuration(tmp_path, endpoint, port)
    first = subprocess.Popen(
        onemap_command("up", "--config", str(config), "--logs", str(tmp_path / "first"))
        + ("--only", "router,gateway"),
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        status = eventually(lambda: status_of(port))
        assert "up" not in [service["name"] for service in status["services"]]
        second = up(config, tmp_path / "second", "--only", "gateway")
        assert second.exit_code == EXIT_FAILED
        assert ": gateway. Stop" in second.stderr
        assert started(tmp_path / "second") == []
        assert status_of(port) is not None
    finally:
        first.send_signal(signal.SIGINT)
        _, stderr = first.communicate(timeout=PATIENCE_S)
    assert first.returncode == EXIT_OK, stderr


def status_of(port: int) -> dict | None:
    try:
        answer = httpx.get(
            f"http://127.0.0.1:{port}/v1/status", trust_env=False, timeout=PATIENCE_S
        )
        document: dict = answer.json()
    except httpx.TransportError:
        return None
    return document


def test_a_taken_port_is_reported_before_anything_starts(tmp_path: Path) -> None:
    endpoint = f"tcp/127.0.0.1:{any_free_port()}"
    with socket.create_server(("127.0.0.1", 0)) as other:
        config = configuration(tmp_path, endpoint, other.getsockname()[1])
        result = up(config, tmp_path / "logs")
    assert result.exit_code == EXIT_FAILED
    assert "Nothing was started" in result.stderr
    assert "gateway.port" in result.stderr
    assert started(tmp_path / "logs") == []
    assert not accepts_connections(endpoint)


def test_a_router_that_cannot_listen_ends_the_command(tmp_path: Path) -> None:
    """The port is bound and accepts nothing, as when two launchers start at the same instant."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        result = up(configuration(tmp_path, endpoint), tmp_path / "logs", "--only", "router")
    assert result.exit_code == EXIT_FAILED
    assert "The router cannot listen" in result.stderr


def test_a_second_router_is_not_started(router: Router, tmp_path: Path) -> None:
    config = configuration(tmp_path, router.endpoint)
    eventually(lambda: accepts_connections(router.endpoint) or None)
    result = up(config, tmp_path / "logs", "--only", "router,gateway")
    assert result.exit_code == EXIT_FAILED
    assert "A router answers" in result.stderr
    assert started(tmp_path / "logs") == []


@pytest.mark.parametrize(
    ("sections", "reason"),
    [
        ({"simulator": {}, "replay": {}}, "both robots"),
        ({"simulator": {"scene": "flat.txt"}}, "suffix '.txt' is not one of"),
        ({"simulator": {"scene": "/no/such.glb"}}, "does not exist"),
        ({"replay": {"directory": "/no/such"}}, "cannot read /no/such/frames.json"),
        ({"simulator": {"sede": 1}}, "did you mean 'seed'"),
    ],
    ids=str,
)
def test_what_cannot_work_is_refused_before_anything_starts(
    tmp_path: Path, sections: dict[str, Any], reason: str
) -> None:
    endpoint = f"tcp/127.0.0.1:{any_free_port()}"
    config = configuration(tmp_path, endpoint, **sections)
    result = up(config, tmp_path / "logs")
    assert result.exit_code == EXIT_USAGE_ERROR
    assert reason in result.stderr
    assert "Traceback" not in result.stderr
    assert started(tmp_path / "logs") == []
    assert not accepts_connections(endpoint)
