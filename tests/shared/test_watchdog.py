"""When a process ends by itself because it hangs."""

from __future__ import annotations

import subprocess
import sys

import pytest

from onemap_shared.watchdog import HANG_LIMIT_S, TICK_S, ThreadCheck


def enumerate_s(steps: list[int]) -> list[tuple[float, int]]:
    return [(TICK_S * number, each) for number, each in enumerate(steps)]


def test_a_thread_without_progress_is_named() -> None:
    check = ThreadCheck("the planning thread")
    count = int(HANG_LIMIT_S / TICK_S)
    for now_s, _ in enumerate_s([0] * (count + 1)):
        check(3, now_s)
    with pytest.raises(RuntimeError, match="the planning thread has made no progress for 20 s"):
        check(3, TICK_S * (count + 1))


def test_a_library_that_holds_the_interpreter_is_ended_too() -> None:
    """A C call with the lock held: no Python thread runs any more."""
    code = (
        "import ctypes, threading\n"
        "from onemap_shared import watchdog\n"
        "watchdog.TICK_S, watchdog.LOCK_LIMIT_S = 0.01, 1.0\n"
        "progress = watchdog.LoopProgress()\n"
        "progress.begin()\n"
        "watchdog.watch('mapper', progress, threading.Event())\n"
        "threading.Event().wait(0.5)\n"
        "ctypes.PyDLL(None).sleep(600)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.returncode == 1
    assert "Timeout (0:00:01)!" in result.stderr
