"""Whether a process group runs, for real groups."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

from onemap_tools.processes.process_group import (
    has_ended,
    running_groups,
    signal_group,
    wait_for_groups,
)

SOON_S = 60.0  # a deadline for a loaded machine, not a measure


def test_a_zombie_does_not_run() -> None:
    """A child that has ended and is not reaped, as by process 1 of many containers."""
    child = subprocess.Popen([sys.executable, "-c", "pass"], start_new_session=True)
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    os.killpg(child.pid, 0)  # still listed
    assert has_ended(child)
    assert running_groups([child.pid]) == frozenset()
    child.wait()
    assert has_ended(child)
    assert running_groups([child.pid]) == frozenset()


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
    assert running_groups([leader.pid]) == {leader.pid}
    os.kill(child, signal.SIGSTOP)  # a stopped process counts
    assert running_groups([leader.pid]) == {leader.pid}
    os.kill(child, signal.SIGKILL)
    assert wait_for_groups([leader.pid], time.monotonic() + SOON_S)
    leader.stdout.close()


def test_a_signal_reaches_the_whole_group() -> None:
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'input()'])"
    leader = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, start_new_session=True
    )
    signal_group(leader.pid, signal.SIGKILL)
    assert leader.wait(SOON_S) == -signal.SIGKILL
    assert wait_for_groups([leader.pid], time.monotonic() + SOON_S)
    signal_group(leader.pid, signal.SIGTERM)  # none is left: no error


def test_the_wait_ends_at_the_deadline() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, start_new_session=True
    )
    assert not wait_for_groups([process.pid], time.monotonic())
    assert not has_ended(process)
    process.kill()
    process.wait()
    assert wait_for_groups([], time.monotonic())
