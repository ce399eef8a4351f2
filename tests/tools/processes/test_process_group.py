"""Whether a process group runs, for real groups."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

from onemap_tools.processes.process_group import (
    group_runs,
    signal_group,
    wait_for,
    wait_for_group,
)

SOON_S = 20.0  # a deadline for a loaded machine, not a measure


def test_a_zombie_does_not_run() -> None:
    """A child that has ended and is not reaped, as by process 1 of many containers."""
    child = subprocess.Popen([sys.executable, "-c", "pass"], start_new_session=True)
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    os.killpg(child.pid, 0)  # still listed
    assert not group_runs(child.pid)
    child.wait()
    assert not group_runs(child.pid)


def test_a_group_runs_as_long_as_one_of_its_processes() -> None:
    """The leader has ended and its child runs on."""
    code = (
        "import subprocess, sys;"
        "print(subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']).pid)"
    )
    leader = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert leader.stdout is not None
    child = int(leader.stdout.readline())
    leader.wait()
    assert group_runs(leader.pid)
    os.kill(child, signal.SIGSTOP)  # a stopped process counts
    assert group_runs(leader.pid)
    os.kill(child, signal.SIGKILL)
    wait_for_group(leader.pid, time.monotonic() + SOON_S)
    assert not group_runs(leader.pid)
    leader.stdout.close()


def test_a_signal_reaches_the_whole_group() -> None:
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'input()'])"
    leader = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, start_new_session=True
    )
    signal_group(leader, signal.SIGKILL)
    wait_for(leader, time.monotonic() + SOON_S)
    assert leader.returncode == -signal.SIGKILL
    wait_for_group(leader.pid, time.monotonic() + SOON_S)
    assert not group_runs(leader.pid)
    signal_group(leader, signal.SIGTERM)  # none is left: no error


def test_the_wait_ends_at_the_deadline() -> None:
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    wait_for(process, time.monotonic())
    assert process.returncode is None
    process.kill()
    process.wait()
