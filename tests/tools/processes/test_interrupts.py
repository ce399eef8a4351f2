"""The first signal stops cleanly, the second at once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

from onemap_tools.processes.interrupts import SIGNALS, interruptible


def test_the_first_signal_sets_the_event() -> None:
    abandoned: list[bool] = []
    with interruptible(lambda: abandoned.append(True)) as stop:
        assert not stop.is_set()
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.wait(60.0)
    assert abandoned == []


def test_the_handlers_are_restored() -> None:
    before = [signal.getsignal(signum) for signum in SIGNALS]
    with interruptible():
        assert [signal.getsignal(signum) for signum in SIGNALS] != before
    assert [signal.getsignal(signum) for signum in SIGNALS] == before


def test_the_second_signal_abandons_and_exits() -> None:
    code = (
        "import os, signal\n"
        "from onemap_tools.processes.interrupts import interruptible\n"
        "with interruptible(lambda: print('abandoned', flush=True)) as stop:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    print('still here')\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.returncode == 128 + signal.SIGTERM
    assert result.stdout == "abandoned\n"
