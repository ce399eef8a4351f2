"""Which services ``onemap up`` starts, and what it does when one exits."""

from __future__ import annotations

import io
import os
import signal
import sys
import time
from pathlib import Path

import pytest
from rich.console import Console

from onemap_tools.errors import CliError
from onemap_tools.processes import up as module
from onemap_tools.processes.launch import Processes, ProcessSpec
from onemap_tools.processes.network import accepts_connections, any_free_port
from onemap_tools.processes.router import CANNOT_LISTEN
from onemap_tools.processes.services import CORE
from onemap_tools.processes.up import choose, conflicts, page_url, supervise, up
from tests.shared.test_bus import Router, eventually, router

__all__ = ["router"]  # the fixture


def said(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize("robot", ["simulator", "replay", "robot"])
def test_a_service_that_runs_conflicts_and_a_map_follows_one_robot(robot: str) -> None:
    assert conflicts(("up", "doctor", "planner", "mapper"), ("mapper", "gateway")) == ["mapper"]
    assert conflicts((robot,), ("replay", "mapper")) == [robot]
    assert conflicts((robot,), ("mapper",)) == []


def test_the_robot_is_the_one_that_the_file_describes() -> None:
    def chosen(*sections: str) -> tuple[str, ...]:
        return choose((), {key: {} for key in sections}, has_file=True, router_here=False)

    assert chosen("log") == CORE  # a real robot
    assert chosen("replay") == ("replay", *CORE)
    assert chosen("simulator") == ("simulator", *CORE)


def until_reported(processes: Processes) -> str:
    console = Console(file=io.StringIO(), width=500)

    def reported() -> str:
        supervise(processes, time.monotonic(), console)
        return said(console)

    return eventually(lambda: reported() or None)


@pytest.mark.parametrize(
    ("name", "reason", "code"),
    [("planner", "planner.radus is unknown", 2), ("router", CANNOT_LISTEN, 1)],
)
def test_what_a_restart_cannot_help_ends_the_command(
    tmp_path: Path, name: str, reason: str, code: int
) -> None:
    script = f"print({reason!r}, flush=True); raise SystemExit({code})"
    with Processes([ProcessSpec(name, (sys.executable, "-c", script))], tmp_path) as processes:
        processes.start()
        with pytest.raises(CliError, match=reason) as error:
            until_reported(processes)
    assert error.value.exit_code == code


@pytest.mark.parametrize(
    ("name", "reason", "code"),
    [
        ("router", CANNOT_LISTEN, 1),
        ("planner", "planner.radus is unknown", 2),  # the file was edited while it ran
    ],
)
def test_what_has_run_before_is_started_again_whatever_its_code(
    tmp_path: Path, name: str, reason: str, code: int
) -> None:
    """The first start crashes, the second is refused, the third runs."""
    script = (
        "import pathlib, sys, time\n"
        f"starts = pathlib.Path({str(tmp_path / 'starts')!r})\n"
        "count = len(starts.read_text()) if starts.exists() else 0\n"
        "starts.write_text('x' * (count + 1))\n"
        "if count == 0: print('out of memory', flush=True); sys.exit(1)\n"
        f"if count == 1: print({reason!r}, flush=True); sys.exit({code})\n"
        "print('it runs', flush=True); time.sleep(600)\n"
    )
    spec = ProcessSpec(name, (sys.executable, "-c", script))
    with Processes([spec], tmp_path / "logs") as processes:
        processes.start()
        report = until_reported(processes)
        assert f"{name} ended with code 1" in report
        assert "out of memory" in report
        console = Console(file=io.StringIO(), width=500)
        supervise(processes, time.monotonic() + 60, console)
        assert said(console) == f"Started {name} again.\n"
        report = until_reported(processes)
        assert reason in report
        assert "It is started again." in report
        processes.restart(time.monotonic() + 60)
        eventually(lambda: "it runs" in (tmp_path / "logs" / f"{name}.log").read_text() or None)


class StopAt(io.StringIO):
    """Sends this process SIGTERM as soon as the text is printed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self._text = text

    def write(self, text: str) -> int:
        if self._text in text:
            os.kill(os.getpid(), signal.SIGTERM)
        return super().write(text)


@pytest.fixture(autouse=True)
def _sleepers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every service is a process that only sleeps."""
    sleep = (sys.executable, "-c", "import time; time.sleep(600)")
    monkeypatch.setattr(module, "onemap_command", lambda *_: sleep)


def test_services_run_until_the_signal(router: Router, tmp_path: Path) -> None:
    out, port, logs = StopAt("Ctrl-C ends them"), any_free_port(), tmp_path / "logs"
    config = tmp_path / "robot.yaml"
    config.write_text(f"bus: {{connect: [{router.endpoint}]}}\ngateway: {{port: {port}}}\n")
    eventually(lambda: accepts_connections(router.endpoint) or None)
    up(config, ("mapper", "gateway"), logs, Console(file=out, width=500))
    assert out.getvalue().splitlines() == [
        f"Started mapper, gateway; logs in {logs}. "
        f"Live page: http://127.0.0.1:{port}. Ctrl-C ends them.",
        "Stopping ...",
    ]
    assert sorted(log.name for log in logs.iterdir()) == ["gateway.log", "mapper.log"]


@pytest.mark.parametrize(
    ("names", "gateway", "url"),
    [
        (("mapper",), {}, ""),
        (("gateway",), {}, "http://127.0.0.1:8080"),
        (("gateway",), {"host": "0.0.0.0", "token": "t" * 32}, "http://127.0.0.1:8080"),
        (("gateway",), {"host": "localhost", "port": 90}, "http://localhost:90"),
        (("gateway",), {"port": 0}, ""),
    ],
)
def test_the_page_s_address_is_that_on_this_machine(
    names: tuple[str, ...], gateway: dict[str, object], url: str
) -> None:
    assert page_url(names, {"gateway": gateway}) == url


def test_the_signal_ends_the_wait_for_a_router(tmp_path: Path) -> None:
    out, config = StopAt("Waiting for a router"), tmp_path / "robot.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{any_free_port()}]}}\n")
    up(config, ("mapper",), tmp_path / "logs", Console(file=out, width=500))
    assert "Started" not in out.getvalue()
    assert list((tmp_path / "logs").iterdir()) == []
