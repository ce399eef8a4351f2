"""Which services ``onemap up`` starts, and what it does when one exits."""

from __future__ import annotations

import io
import sys
import time
from pathlib import Path

import pytest
from rich.console import Console

from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.launch import Processes, ProcessSpec
from onemap_tools.processes.services import CORE
from onemap_tools.processes.up import choose, supervise

SOON_S = 20.0


def test_without_a_file_everything_is_simulated() -> None:
    chosen = choose((), {}, has_file=False, router_here=True)
    assert chosen == ("router", "simulator", *CORE)


def test_the_robot_is_the_one_that_the_file_describes() -> None:
    def chosen(*sections: str) -> tuple[str, ...]:
        return choose((), {key: {} for key in sections}, has_file=True, router_here=False)

    assert chosen("log") == CORE  # a real robot
    assert chosen("replay") == ("replay", *CORE)
    assert chosen("simulator") == ("simulator", *CORE)


def test_only_starts_nothing_else() -> None:
    chosen = choose(("mapper", "router"), {"simulator": {}}, has_file=True, router_here=False)
    assert chosen == ("router", "mapper")


@pytest.mark.parametrize("only", [(), ("simulator", "replay")])
def test_two_robots_are_refused(only: tuple[str, ...]) -> None:
    with pytest.raises(CliError, match="both robots") as error:
        choose(only, {"simulator": {}, "replay": {}}, has_file=True, router_here=True)
    assert error.value.exit_code == EXIT_USAGE_ERROR


def test_only_chooses_between_two_robots() -> None:
    sections: dict[str, dict] = {"simulator": {}, "replay": {}}
    assert choose(("replay",), sections, has_file=True, router_here=True) == ("replay",)


def test_an_unknown_name_is_a_usage_error() -> None:
    with pytest.raises(CliError, match="no 'maper' to start") as error:
        choose(("maper",), {}, has_file=False, router_here=True)
    assert error.value.exit_code == EXIT_USAGE_ERROR


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
