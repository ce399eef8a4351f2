"""Ends a process whose main loop hangs, or that does not stop when it is told to.

A thread counts the time without progress. If that thread cannot run either, because a library
holds the interpreter's lock, the C timer of ``faulthandler`` ends the process. Both print where
every thread stands. The supervisor's restart is the recovery.
"""
# Talks: watches the process from a thread.

from __future__ import annotations

import faulthandler
import logging
import os
from collections.abc import Callable
from dataclasses import dataclass, field

from onemap_shared.clock import Event, SystemClock
from onemap_shared.log import flush_log

LOG = logging.getLogger("onemap.watchdog")

TICK_S = 0.5
HANG_LIMIT_S = (
    20.0  # a step of the main loop; the longest, a first image on a GPU, takes under 10 s
)
STOP_LIMIT_S = 10.0  # from the signal to the end: 3 s, and what a loaded machine adds
LOCK_LIMIT_S = 60.0  # without the interpreter; a process that was suspended for longer ends too
REPORT_S = 2.0  # for the report: its reader may hang as well
EXIT_HUNG = 1
STDERR = 2  # the descriptor: the object may be replaced


@dataclass(slots=True)
class LoopProgress:
    """Steps of a main loop; None before it begins, which may take long: models are loaded."""

    steps: int | None = None

    def begin(self) -> None:
        """The loop begins: from now on it has to advance."""
        self.steps = 0

    def advance(self) -> None:
        """Count a step."""
        self.steps = (self.steps or 0) + 1


@dataclass(slots=True)
class StallTimer:
    """Counts the seconds without progress.

    A call counts at most ``TICK_S``: a suspended process, or one that gets no processor time,
    is no hanging one.
    """

    seen: int | None = None
    called_s: float | None = None
    still_s: float = 0.0

    def update(self, steps: int | None, now_s: float) -> float:
        """Seconds since ``steps`` last changed. ``now_s``: monotonic."""
        passed_s = 0.0 if self.called_s is None else min(now_s - self.called_s, TICK_S)
        self.still_s = self.still_s + passed_s if steps == self.seen else 0.0
        self.seen, self.called_s = steps, now_s
        return self.still_s


@dataclass(slots=True)
class ThreadCheck:
    """Whether a thread that a main loop depends on makes progress."""

    name: str
    timer: StallTimer = field(default_factory=StallTimer)

    def __call__(self, turns: int, now_s: float) -> None:
        """Raise RuntimeError if ``turns`` has not changed for ``HANG_LIMIT_S``."""
        if self.timer.update(turns, now_s) > HANG_LIMIT_S:
            faulthandler.dump_traceback(file=STDERR)
            raise RuntimeError(f"{self.name} has made no progress for {HANG_LIMIT_S:g} s")


def watch(
    service: str,
    progress: LoopProgress,
    stop: Event,
    end: Callable[[int], object] = os._exit,
) -> Event:
    """End the process with code 1 if its loop hangs, or if it does not stop.

    Returns the event that ends the watch. ``stop``: set when the process has to stop.
    """
    clock = SystemClock()  # of the process, which the watch is about
    done = clock.event()

    loop, stopping = StallTimer(), StallTimer(seen=0)

    def reason(now_s: float) -> str:
        still_s = loop.update(progress.steps, now_s)
        if stop.is_set() and stopping.update(0, now_s) > STOP_LIMIT_S:
            return f"it has not stopped {STOP_LIMIT_S:g} s after it was told to"
        if progress.steps is not None and still_s > HANG_LIMIT_S:
            return f"its main loop has made no progress for {HANG_LIMIT_S:g} s"
        return ""

    def run() -> None:
        while not done.wait(TICK_S):
            if progress.steps is not None or stop.is_set():
                faulthandler.dump_traceback_later(LOCK_LIMIT_S, exit=True, file=STDERR)
            if problem := reason(clock.monotonic_s()):
                _report(f"{service} ends, to be restarted: {problem}")
                end(EXIT_HUNG)
                break
        faulthandler.cancel_dump_traceback_later()

    clock.thread("watchdog", run)
    return done


def _report(sentence: str) -> None:
    """Log the sentence and where each thread stands, for at most ``REPORT_S``."""

    def write() -> None:
        LOG.critical("%s", sentence)
        flush_log()
        faulthandler.dump_traceback(file=STDERR)

    SystemClock().thread("watchdog-report", write).join(REPORT_S)
