"""Process groups: signal one, wait until none of its processes runs.

The leader of a group is reaped last: as long as it is a zombie, the kernel gives the number of
its group to no other process.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Collection

import psutil

POLL_S = 0.01
ENDED = (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


def signal_group(group: int, signum: signal.Signals) -> None:
    """Signal all processes of a group; none may be left."""
    try:
        os.killpg(group, signum)
    except (ProcessLookupError, PermissionError):  # none is left
        return


def has_ended(process: subprocess.Popen[bytes]) -> bool:
    """Whether a child process has ended. It is not reaped."""
    if process.returncode is not None:
        return True
    status = os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    return status is not None


def wait_for_groups(groups: Collection[int], deadline_s: float) -> bool:
    """Wait until no process of these groups runs or ``time.monotonic()`` is the deadline.

    Returns whether all have ended: a killed process ends shortly after the signal.
    """
    while running_groups(groups):
        if time.monotonic() >= deadline_s:
            return False
        time.sleep(POLL_S)
    return True


def running_groups(groups: Collection[int]) -> frozenset[int]:
    """Those of the groups in which a process runs.

    Zombies are ignored: they run no code and hold no file. An orphan is reaped by process 1,
    which in a container may never happen.
    """
    if not groups:
        return frozenset()
    found = (_group_of(process) for process in psutil.process_iter())
    return frozenset(groups).intersection(group for group in found if group is not None)


def _group_of(process: psutil.Process) -> int | None:
    """The group of a process that runs; None if it has ended or is not to be seen."""
    try:
        group = os.getpgid(process.pid)
        return None if process.status() in ENDED else group
    except (ProcessLookupError, PermissionError, psutil.Error):
        return None
