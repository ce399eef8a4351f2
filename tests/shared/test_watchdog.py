"""When a process ends by itself because it hangs."""

from __future__ import annotations

import subprocess
import sys
import threading

import pytest

from onemap_shared import watchdog
from onemap_shared.watchdog import (
    HANG_LIMIT_S,
    TICK_S,
    LoopProgress,
    StallTimer,
    ThreadCheck,
    watch,
)

SOON_S = 90.0


def test_the_seconds_without_progress_are_counted() -> None:
    timer = StallTimer()
    still_s = [timer.update(steps, now_s) for now_s, steps in enumerate_s([7, 7, 7, 8, 8])]
    assert still_s == [0.0, TICK_S, 2 * TICK_S, 0.0, TICK_S]


def enumerate_s(steps: list[int]) -> list[tuple[float, int]]:
    return [(TICK_S * number, each) for number, each in enumerate(steps)]


def test_a_thread_without_progress_is_named() -> None:
    check = ThreadCheck("the planning thread")
    count = int(HANG_LIMIT_S / TICK_S)
    for now_s, _ in enumerate_s([0] * (count + 1)):
        check(3, now_s)
    with pytest.raises(RuntimeError, match="the planning thread has made no progress for 20 s"):
        check(3, TICK_S * (count + 1))


def short(monkeypatch: pytest.MonkeyPatch, limit_s: float = 0.05) -> None:
    """Make every limit of the watchdog short."""
    monkeypatch.setattr(watchdog, "TICK_S", 0.01)
    for name in ("HANG_LIMIT_S", "STOP_LIMIT_S"):
        monkeypatch.setattr(watchdog, name, limit_s)


def test_a_loop_that_has_begun_and_stands_still_ends_the_process(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    short(monkeypatch)
    progress, ended = LoopProgress(), threading.Event()
    progress.begin()
    watch("mapper", progress, threading.Event(), lambda _: ended.set())
    assert ended.wait(SOON_S)
    assert "its main loop has made no progress" in caplog.text


def test_the_end_is_reported_with_where_each_thread_stands(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    short(monkeypatch)
    stop, ended = threading.Event(), threading.Event()
    stop.set()
    codes: list[int] = []

    def end(code: int) -> None:
        codes.append(code)
        ended.set()

    watch("mapper", LoopProgress(), stop, end)
    assert ended.wait(SOON_S)
    assert codes == [1]
    assert "mapper ends, to be restarted: it has not stopped" in caplog.text


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
