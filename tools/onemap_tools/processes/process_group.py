"""Process groups: signal one, wait until none of its processes runs."""

from __future__ import annotations

import os
import signal
import subprocess
import time

import psutil

POLL_S = 0.005
ENDED = (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


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
    return any(_runs_in(process, group) for process in psutil.process_iter())


def _runs_in(process: psutil.Process, group: int) -> bool:
    try:
        return os.getpgid(process.pid) == group and process.status() not in ENDED
    except (ProcessLookupError, PermissionError, psutil.NoSuchProcess):
        return False
