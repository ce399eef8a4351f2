"""Starts, supervises and stops a set of processes.

Every process has a session of its own, so that Ctrl-C reaches only the launcher, and the
launcher's process id in its environment, so that it stops by itself if the launcher is killed.
The output of a process goes to its log file.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from onemap_shared.runner import PARENT_VARIABLE
from onemap_shared.supervisor import LAUNCHED_VARIABLE
from onemap_shared.watchdog import STOP_LIMIT_S
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

# From SIGTERM to SIGKILL. The mapper writes its map, mostly in a second; what has not ended after
# STOP_LIMIT_S ends by itself and says where.
GRACE_S = STOP_LIMIT_S + 5.0
RESTART_S = 3.0  # from its end to its next start
TAIL_LINES = 12
TAIL_BYTES = 8192
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """A process to start. ``last``: stopped after the others, as the router is."""

    name: str
    command: tuple[str, ...]
    last: bool = False


@dataclass(frozen=True, slots=True)
class ProcessExit:
    """An unexpected exit; ``tail``: the last lines of its log; ``first``: of its first start."""

    name: str
    code: int
    log: Path
    tail: str
    first: bool = False

    @property
    def misconfigured(self) -> bool:
        return self.code == EXIT_USAGE_ERROR

    @property
    def report(self) -> str:
        """What happened, with the last lines of its log."""
        if self.code < 0:
            how = f"was killed by {signal.Signals(-self.code).name}"
        elif self.misconfigured:
            how = "cannot start as configured"
        else:
            how = f"ended with code {self.code}"
        return f"{self.name} {how}; its log is {self.log}. Its last lines:\n{self.tail}"


@dataclass(slots=True)
class _Child:
    spec: ProcessSpec
    log: Path
    process: subprocess.Popen[bytes] | None = None
    starts: int = 0
    due_s: float | None = None  # of the next restart


def onemap_command(*arguments: str) -> tuple[str, ...]:
    """The command line of ``onemap ARGUMENTS...`` with this interpreter."""
    return (sys.executable, "-m", "onemap_tools", *arguments)


def child_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """The environment of a service: the launcher's process id and limits of thread pools.

    A numeric library starts a thread per core in each of five processes by default; with half
    of the cores they do not compete. Variables that the user has set stay.
    """
    here = hasattr(os, "sched_getaffinity")  # not on macOS
    cores = len(os.sched_getaffinity(0)) if here else os.cpu_count() or 1
    return {
        **dict.fromkeys(THREAD_VARIABLES, str(max(1, cores // 2))),
        **environment,
        PARENT_VARIABLE: str(os.getpid()),
        "PYTHONUNBUFFERED": "1",
    }


def make_folder(folder: Path) -> None:
    """Create a folder and its parents; CliError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        reason = problem.strerror or problem
        raise CliError(f"Cannot make the folder {folder}: {reason}.", EXIT_USAGE_ERROR) from problem


class Processes:
    """A set of processes; a context manager that stops them all at its end."""

    def __init__(
        self,
        specs: Sequence[ProcessSpec],
        log_folder: Path,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        make_folder(log_folder)
        self.folder = log_folder
        self._children = [_Child(spec, log_folder / f"{spec.name}.log") for spec in specs]
        self._environment = {
            **child_environment(os.environ if environment is None else environment),
            LAUNCHED_VARIABLE: " ".join(spec.name for spec in specs),
        }

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self, *names: str) -> None:
        """Start the named processes, all without names; those that run are left alone."""
        for child in self._children:
            if child.process is None and (not names or child.spec.name in names):
                self._start(child)

    @property
    def pids(self) -> dict[str, int]:
        """The numbers of the processes that run, by their names."""
        return {c.spec.name: c.process.pid for c in self._children if c.process is not None}

    def _start(self, child: _Child) -> None:
        child.due_s = None
        child.starts += 1
        with child.log.open("ab") as log:
            child.process = subprocess.Popen(
                child.spec.command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
            )

    def collect(self, now_s: float) -> list[ProcessExit]:
        """The exits since the last call; each process is scheduled for a restart.

        The child processes that it left are killed: they may hold its port or its files.
        ``now_s`` is ``time.monotonic()``.
        """
        ended = []
        for child in self._children:
            if child.process is None or (code := child.process.poll()) is None:
                continue
            signal_group(child.process.pid, signal.SIGKILL)
            child.process, child.due_s = None, now_s + RESTART_S
            first = child.starts == 1
            ended.append(ProcessExit(child.spec.name, code, child.log, tail(child.log), first))
        return ended

    def restart(self, now_s: float) -> list[str]:
        """Start the processes that are due; returns their names."""
        due = [c for c in self._children if c.due_s is not None and now_s >= c.due_s]
        for child in due:
            self._start(child)
        return [child.spec.name for child in due]

    def stop(self) -> None:
        """Terminate all, and kill what is left of them and of their child processes.

        Takes as long as the slowest of them, which may write what it holds.
        """
        for last in (False, True):
            group = [child for child in self._children if child.spec.last is last]
            running = [child.process for child in group if child.process is not None]
            for child in group:
                child.process = child.due_s = None
            for process in running:
                signal_group(process.pid, signal.SIGTERM)
            deadline_s = time.monotonic() + GRACE_S
            for process in running:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(max(deadline_s - time.monotonic(), 0.0))
            for process in running:
                signal_group(process.pid, signal.SIGKILL)
                process.wait()

    def kill(self) -> None:
        """Kill all at once."""
        for child in self._children:
            if child.process is not None:
                signal_group(child.process.pid, signal.SIGKILL)


def tail(log: Path, lines: int = TAIL_LINES) -> str:
    """The last lines of a log file; empty if it cannot be read."""
    try:
        with log.open("rb") as file:
            file.seek(0, os.SEEK_END)
            file.seek(max(file.tell() - TAIL_BYTES, 0))
            text = file.read().decode(errors="replace")
    except OSError:
        return ""
    return "\n".join(text.splitlines()[-lines:])


def signal_group(group: int, signum: signal.Signals) -> None:
    """Signal all processes of a group; none may be left."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(group, signum)
