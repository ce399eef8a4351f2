"""Which services ``onemap up`` starts, and what it does when one exits."""

from __future__ import annotations

import io
import os
import signal
import socket
import sys
import time
from pathlib import Path

import pytest
from rich.console import Console

from onemap_shared import keys
from onemap_shared.config import BusConfig
from onemap_shared.messages import Heartbeat
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes import up as module
from onemap_tools.processes.launch import Processes, ProcessSpec
from onemap_tools.processes.network import accepts_connections, any_free_port
from onemap_tools.processes.router import CANNOT_LISTEN
from onemap_tools.processes.services import CORE
from onemap_tools.processes.session import temporary_session
from onemap_tools.processes.up import (
    at_first,
    choose,
    page_url,
    refuse_conflicts,
    report_start,
    supervise,
    up,
)
from tests.memory_bus import MemoryRouter
from tests.shared.test_bus import Router, eventually, router

__all__ = ["router"]  # the fixture

SOON_S = 60.0


def test_the_robot_is_the_one_that_the_file_describes() -> None:
    def chosen(*sections: str) -> tuple[str, ...]:
        return choose((), {key: {} for key in sections}, has_file=True, router_here=False)

    assert chosen("log") == CORE  # a real robot
    assert chosen("replay") == ("replay", *CORE)
    assert chosen("simulator") == ("simulator", *CORE)


@pytest.mark.parametrize("only", [(), ("simulator", "replay")])
def test_two_robots_are_refused(only: tuple[str, ...]) -> None:
    with pytest.raises(CliError, match="both robots") as error:
        choose(only, {"simulator": {}, "replay": {}}, has_file=True, router_here=True)
    assert error.value.exit_code == EXIT_USAGE_ERROR


@pytest.mark.parametrize(
    ("names", "sections", "begins_empty"),
    [
        pytest.param(("simulator", "mapper"), {}, True, id="a simulated robot starts"),
        pytest.param(("mapper",), {}, False, id="the robot runs elsewhere"),
        pytest.param(
            ("simulator", "mapper"), {"mapper": {"resume": True}}, False, id="the file says so"
        ),
    ],
)
def test_a_map_begins_empty_with_a_simulated_robot(
    names: tuple[str, ...], sections: dict[str, dict[str, bool]], begins_empty: bool
) -> None:
    assert bool(at_first("mapper", names, sections)) is begins_empty
    assert at_first("planner", names, sections) == ()


def test_a_mapper_that_compiles_is_reported_once_and_when_it_is_done() -> None:
    bus_router = MemoryRouter()
    starts = bus_router.bus().subscribe(keys.heartbeat("mapper"), 8)
    mapper = bus_router.bus().publish(keys.heartbeat("mapper"))
    output = io.StringIO()
    console, said = Console(file=output, width=200), ""
    compiles = {"start_s": 1.0}
    for metrics in ({}, compiles, compiles, {"cells": 0.0}, {"cells": 9.0}):
        problem = "compiling the map's kernels, once" if metrics is compiles else ""
        mapper.put(Heartbeat("mapper", "a", 1, 1, not problem, problem, metrics))
        said = report_start(starts, said, console)
    assert output.getvalue().splitlines() == [
        "The mapper is compiling the map's kernels, once ...",
        "The mapper has started.",
    ]
    assert report_start(starts, said, console) == ""  # nothing new


def until_reported(processes: Processes, console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    deadline = time.monotonic() + SOON_S
    while not console.file.getvalue():
        assert time.monotonic() < deadline
        supervise(processes, time.monotonic(), console)
    return console.file.getvalue()


def test_a_crash_is_reported_and_the_process_restarted(tmp_path: Path) -> None:
    code = "print('out of memory', flush=True); raise SystemExit(1)"
    spec = ProcessSpec("mapper", (sys.executable, "-c", code))
    console = Console(file=io.StringIO(), width=500)
    with Processes([spec], tmp_path) as processes:
        processes.start()
        exit_report = until_reported(processes, console)
        assert "mapper ended with code 1" in exit_report
        assert "out of memory" in exit_report
        supervise(processes, time.monotonic() + 1.5, console)
        assert isinstance(console.file, io.StringIO)
        assert "Started mapper again" in console.file.getvalue()


def test_a_wrong_configuration_ends_the_command(tmp_path: Path) -> None:
    code = "print('planner.radus is unknown', flush=True); raise SystemExit(2)"
    spec = ProcessSpec("planner", (sys.executable, "-c", code))
    console = Console(file=io.StringIO())
    with Processes([spec], tmp_path) as processes:
        processes.start()
        with pytest.raises(CliError, match=r"planner\.radus is unknown"):
            until_reported(processes, console)


def test_a_router_that_cannot_listen_at_first_ends_the_command(tmp_path: Path) -> None:
    code = f"print({CANNOT_LISTEN!r}, flush=True); raise SystemExit(1)"
    console = Console(file=io.StringIO())
    with Processes([ProcessSpec("router", (sys.executable, "-c", code))], tmp_path) as processes:
        processes.start()
        with pytest.raises(CliError, match=CANNOT_LISTEN):
            until_reported(processes, console)


@pytest.mark.parametrize(
    ("name", "reason", "code"),
    [
        ("router", CANNOT_LISTEN, 1),
        ("gateway", "cannot listen on 127.0.0.1 port 8080", 1),
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
        "if count == 0: sys.exit(1)\n"
        f"if count == 1: print({reason!r}, flush=True); sys.exit({code})\n"
        "print('it runs', flush=True); time.sleep(600)\n"
    )
    spec = ProcessSpec(name, (sys.executable, "-c", script))
    with Processes([spec], tmp_path / "logs") as processes:
        processes.start()
        until_reported(processes, Console(file=io.StringIO(), width=500))
        processes.restart(time.monotonic() + 60)
        report = until_reported(processes, Console(file=io.StringIO(), width=500))
        assert reason in report
        assert "It is started again." in report
        processes.restart(time.monotonic() + 60)
        eventually(lambda: "it runs" in (tmp_path / "logs" / f"{name}.log").read_text() or None)


def test_conflicts_are_reported_with_the_router_and_the_namespace() -> None:
    config = BusConfig(connect=("tcp/127.0.0.1:7001",), namespace="fleet")
    refuse_conflicts((), config)
    with pytest.raises(CliError, match=r"tcp/127.0.0.1:7001, namespace fleet: mapper"):
        refuse_conflicts(("mapper",), config)


class StopAt(io.StringIO):
    """Sends this process SIGTERM as soon as the text is printed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self._text = text

    def write(self, text: str) -> int:
        if self._text in text:
            os.kill(os.getpid(), signal.SIGTERM)
        return super().write(text)


@pytest.fixture
def sleepers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every service is a process that only sleeps."""
    sleep = (sys.executable, "-c", "import time; time.sleep(600)")
    monkeypatch.setattr(module, "onemap_command", lambda *_: sleep)


def config_of(folder: Path, endpoint: str, port: int = 0) -> Path:
    path = folder / "robot.yaml"
    path.write_text(
        f"bus: {{connect: [{endpoint}]}}\ngateway: {{port: {port or any_free_port()}}}\n"
    )
    return path


@pytest.mark.usefixtures("sleepers")
def test_services_run_until_the_signal(router: Router, tmp_path: Path) -> None:
    out = StopAt("Ctrl-C ends them")
    port = any_free_port()
    config = config_of(tmp_path, router.endpoint, port)
    eventually(lambda: accepts_connections(router.endpoint) or None)
    up(config, ("mapper", "gateway"), tmp_path / "logs", Console(file=out, width=500))
    lines = out.getvalue().splitlines()
    assert lines == [
        f"Started mapper, gateway; logs in {tmp_path / 'logs'}. "
        f"Live page: http://127.0.0.1:{port}. Ctrl-C ends them.",
        "Stopping ...",
    ]
    assert sorted(log.name for log in (tmp_path / "logs").iterdir()) == [
        "gateway.log",
        "mapper.log",
    ]


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


@pytest.mark.usefixtures("sleepers")
def test_the_signal_ends_the_wait_for_a_router(tmp_path: Path) -> None:
    out = StopAt("Waiting for a router")
    config = config_of(tmp_path, f"tcp/127.0.0.1:{any_free_port()}")
    up(config, ("mapper",), tmp_path / "logs", Console(file=out, width=500))
    assert "Started" not in out.getvalue()
    assert list((tmp_path / "logs").iterdir()) == []


@pytest.mark.usefixtures("sleepers")
def test_a_service_on_the_bus_is_not_started_again(router: Router, tmp_path: Path) -> None:
    config = config_of(tmp_path, router.endpoint)
    with (
        temporary_session(BusConfig(connect=(router.endpoint,)), "mapper", SOON_S),
        pytest.raises(CliError, match=r"already running at .*: mapper\."),
    ):
        up(config, ("mapper",), tmp_path / "logs", Console(file=io.StringIO()))
    with pytest.raises(CliError, match="A router answers"):
        up(config, ("router",), tmp_path / "logs", Console(file=io.StringIO()))


@pytest.mark.usefixtures("sleepers")
def test_a_taken_port_is_reported_before_the_router_starts(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{any_free_port()}"
        config = config_of(tmp_path, endpoint, server.getsockname()[1])
        with pytest.raises(CliError, match="Nothing was started: the gateway"):
            up(config, ("router", "gateway"), tmp_path / "logs", Console(file=io.StringIO()))
    assert list((tmp_path / "logs").iterdir()) == []
