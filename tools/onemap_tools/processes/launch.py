"""Start a set of processes, watch over them, and leave none behind.

Every process gets a session of its own, so that Ctrl-C reaches only the
launcher, and the launcher's process id in its environment, so that it stops by
itself when the launcher was killed. What a process says goes to a log file.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from onemap_shared.runner import PARENT_VARIABLE
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

GRACE_S = 3.0  # from SIGTERM to SIGKILL
LAST_GRACE_S = 1.0  # the same for the process that goes last
KILLED_S = 2.0  # longest wait for the kernel to end what got SIGKILL: milliseconds, unless it hangs
POLL_S = 0.005  # between two looks whether it did
FIRST_BACKOFF_S, LONGEST_BACKOFF_S = 1.0, 10.0
HEALTHY_S = 30.0  # a process that ran this long crashed anew, not again
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
    """What to start. ``last`` processes outlive the others when all are stopped: the router."""

    name: str
    command: tuple[str, ...]
    last: bool = False


@dataclass(frozen=True, slots=True)
class ProcessExit:
    """A process that ended without being asked to."""

    name: str
    code: int
    log: Path
    tail: str

    @property
    def misconfigured(self) -> bool:
        """Whether it refused its configuration: starting it again would not help."""
        return self.code == EXIT_USAGE_ERROR

    @property
    def sentence(self) -> str:
        """What happened, for people."""
        if self.code < 0:
            how = f"was killed by {signal.Signals(-self.code).name}"
        elif self.misconfigured:
            how = "cannot start as configured"
        else:
            how = f"ended with code {self.code}"
        return f"{self.name} {how}; its log is {self.log}"


@dataclass(slots=True)
class _Child:
    spec: ProcessSpec
    log: Path
    process: subprocess.Popen[bytes] | None = None
    started_s: float = 0.0
    failures: int = 0
    due_s: float | None = None


def onemap_command(*arguments: str) -> tuple[str, ...]:
    """The command line of ``onemap ARGUMENTS...`` with this very interpreter."""
    return (sys.executable, "-m", "onemap_tools", *arguments)


def child_environment(environment: Mapping[str, str], cores: int) -> dict[str, str]:
    """The environment of a service: its launcher's id, and libraries that share the cores.

    Each numeric library would start a thread per core in each of five processes; half
    of the cores each keeps them out of each other's way. What the user set stays.
    """
    threads = str(max(1, cores // 2))
    return {
        **dict.fromkeys(THREAD_VARIABLES, threads),
        **environment,
        PARENT_VARIABLE: str(os.getpid()),
        "PYTHONUNBUFFERED": "1",
    }


def available_cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def backoff_s(failures: int) -> float:
    """How long to wait before the start that follows this many failures in a row."""
    longest: float = min(FIRST_BACKOFF_S * 2 ** (failures - 1), LONGEST_BACKOFF_S)
    return longest


def make_folder(folder: Path) -> None:
    """Make a folder and those above it; CliError if that is not possible."""
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
        inherited = os.environ if environment is None else environment
        self._environment = child_environment(inherited, available_cores())

    def __enter__(self) -> Processes:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    @property
    def names(self) -> tuple[str, ...]:
        """All of them, whether they run or not."""
        return tuple(child.spec.name for child in self._children)

    def start(self, *names: str) -> None:
        """Start those of these names, or all without any, that do not run."""
        for child in self._children:
            if child.process is None and (not names or child.spec.name in names):
                self._start(child)

    def _start(self, child: _Child) -> None:
        child.due_s = None
        child.started_s = time.monotonic()
        with child.log.open("ab") as log:
            child.process = subprocess.Popen(
                child.spec.command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
            )

    def pids(self) -> dict[str, int]:
        """The process ids of those that run."""
        return {
            child.spec.name: child.process.pid
            for child in self._children
            if child.process is not None and child.process.poll() is None
        }

    def collect(self, now_s: float) -> list[ProcessExit]:
        """Those that ended since the last call, each scheduled for a restart after a pause.

        ``now_s`` is ``time.monotonic()``.
        """
        ended = []
        for child in self._children:
            code = child.process.poll() if child.process is not None else None
            if code is None:
                continue
            child.process = None
            healthy = now_s - child.started_s >= HEALTHY_S
            child.failures = 1 if healthy else child.failures + 1
            child.due_s = now_s + backoff_s(child.failures)
            ended.append(ProcessExit(child.spec.name, code, child.log, tail(child.log)))
        return ended

    def restart(self, now_s: float) -> list[str]:
        """Start those whose pause is over; returns their names."""
        due = [c for c in self._children if c.due_s is not None and now_s >= c.due_s]
        for child in due:
            self._start(child)
        return [child.spec.name for child in due]

    def stop(self) -> None:
        """Ask all to end, wait, kill the rest; returns when their own children are gone too.

        Under 5 s, unless the kernel itself holds on to a killed process.
        """
        first = [child for child in self._children if not child.spec.last]
        last = [child for child in self._children if child.spec.last]
        for group, grace_s in ((first, GRACE_S), (last, LAST_GRACE_S)):
            running = [c.process for c in group if c.process is not None]
            for child in group:
                child.process = child.due_s = None
            for process in running:
                _signal(process, signal.SIGTERM)
            deadline = time.monotonic() + grace_s
            for process in running:
                _wait(process, deadline)
            for process in running:
                _signal(process, signal.SIGKILL)
                process.wait()
            deadline = time.monotonic() + KILLED_S
            for process in running:
                wait_for_group(process.pid, deadline)

    def kill(self) -> None:
        """End all at once."""
        for child in self._children:
            if child.process is not None:
                _signal(child.process, signal.SIGKILL)


def _signal(process: subprocess.Popen[bytes], signum: signal.Signals) -> None:
    """Signal the process's whole session, its own children included."""
    try:
        os.killpg(process.pid, signum)
    except (ProcessLookupError, PermissionError):  # all gone already
        return


def _wait(process: subprocess.Popen[bytes], deadline_s: float) -> None:
    try:
        process.wait(timeout=max(deadline_s - time.monotonic(), 0.0))
    except subprocess.TimeoutExpired:
        return


def wait_for_group(group: int, deadline_s: float) -> None:
    """Return when no process of the group runs: a killed one ends a moment after the signal."""
    while group_runs(group) and time.monotonic() < deadline_s:
        time.sleep(POLL_S)


def group_runs(group: int) -> bool:
    """Whether a process of this group still runs.

    A zombie counts as gone: it runs no code and holds no file. An orphan's is reaped by
    process 1, which in a container may never do so.
    """
    try:
        os.killpg(group, 0)
    except (ProcessLookupError, PermissionError):  # macOS: EPERM where only zombies are left
        return False
    if not Path("/proc/self/stat").exists():
        return True
    return any(_runs_in(stat, group) for stat in Path("/proc").glob("[0-9]*/stat"))


def _runs_in(stat: Path, group: int) -> bool:
    """Whether a process, by its /proc/PID/stat, is of this group and no zombie."""
    try:  # PID (NAME) STATE PARENT GROUP ...; the name may hold anything
        state, _parent, of_group = stat.read_text().rpartition(")")[2].split()[:3]
    except OSError:  # gone in between
        return False
    return int(of_group) == group and state not in "ZX"


def tail(log: Path, lines: int = TAIL_LINES) -> str:
    """The last lines of a log file; empty if there is none."""
    try:
        with log.open("rb") as file:
            file.seek(0, os.SEEK_END)
            file.seek(max(file.tell() - TAIL_BYTES, 0))
            text = file.read().decode(errors="replace")
    except OSError:
        return ""
    return "\n".join(text.splitlines()[-lines:])
