"""Process groups: signal one, wait until none of its processes runs."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

POLL_S = 0.005


def signal_group(process: subprocess.Popen[bytes], signum: signal.Signals) -> None:
    """Signal the process and all processes of its session."""
    try:
        os.killpg(process.pid, signum)
    except (ProcessLookupError, PermissionError):  # none is left
        return


def wait_for(process: subprocess.Popen[bytes], deadline_s: float) -> None:
    """Return when the process has ended or ``time.monotonic()`` has reached the deadline."""
    try:
        process.wait(timeout=max(deadline_s - time.monotonic(), 0.0))
    except subprocess.TimeoutExpired:
        return


def wait_for_group(group: int, deadline_s: float) -> None:
    """As ``wait_for`` for all processes of a group: a killed one ends shortly after the signal."""
    while group_runs(group) and time.monotonic() < deadline_s:
        time.sleep(POLL_S)


def group_runs(group: int) -> bool:
    """Whether a process of this group runs.

    Zombies are ignored: they run no code and hold no file. An orphan is reaped by process 1,
    which in a container may never happen.
    """
    try:
        os.killpg(group, 0)
    except (ProcessLookupError, PermissionError):  # macOS: EPERM where only zombies are left
        return False
    if not Path("/proc/self/stat").exists():
        return True
    return any(_runs_in(stat, group) for stat in Path("/proc").glob("[0-9]*/stat"))


def _runs_in(stat: Path, group: int) -> bool:
    """Whether a process, by its /proc/PID/stat, is in this group and not a zombie."""
    try:  # PID (NAME) STATE PARENT GROUP ...; the name may contain any character
        state, _parent, of_group = stat.read_text().rpartition(")")[2].split()[:3]
    except OSError:  # it ended in between
        return False
    return int(of_group) == group and state not in "ZX"
