"""Writes the steps of searches to disk in a thread of its own, so that control never waits."""
# Talks: the thread that writes, and its log.

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path

from onemap_planner.search.decision_log import MAX_PLACES, Place, record
from onemap_shared.clock import Clock
from onemap_shared.messages import SearchStatus

LOG = logging.getLogger("onemap.planner")

MAX_WAITING = 100  # steps: a search makes a few a minute, so the disk stands still for long
CLOSE_S = 2.0  # for which the end of the process waits for the disk


@dataclass(frozen=True, slots=True)
class RecordedStep:
    """A step of a search; robot_xy: metres, None: not known; places: since the step before."""

    status: SearchStatus
    robot_xy: tuple[float, float] | None
    places: tuple[Place, ...] = ()


class SearchRecorder:
    """Records steps in the order in which they are added; without a folder it records nothing.

    Where the disk stands still the newest step replaces the one that waits last. A disk that fails
    is told once, and tried again with the next step.
    """

    def __init__(self, folder: Path | None, clock: Clock) -> None:
        self._folder = folder
        self._waiting: deque[RecordedStep] = deque()
        self._changed = clock.condition()
        self._closed = False
        self._kept = ("", 0)  # the search of the last line, and how many results it has
        self._reported: set[str] = set()
        self._thread = None if folder is None else clock.thread("record", self._run)

    def add(self, step: RecordedStep) -> None:
        """Take a step to record; returns at once."""
        if self._folder is None:
            return
        with self._changed:
            if len(self._waiting) >= MAX_WAITING and self._waiting[-1].status.active:
                places = (*self._waiting.pop().places, *step.places)
                step = replace(step, places=places[-MAX_PLACES:])
            self._waiting.append(step)
            self._changed.notify()

    def close(self) -> None:
        """Record what waits; gives up on a disk that stands still after ``CLOSE_S``."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(CLOSE_S)

    def _run(self) -> None:
        while (step := self._next()) is not None:
            self._record(step)

    def _next(self) -> RecordedStep | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            return self._waiting.popleft() if self._waiting else None

    def _record(self, step: RecordedStep) -> None:
        assert self._folder is not None
        kept = (step.status.search_id, len(step.status.results))
        try:
            record(self._folder, step.status, step.robot_xy, step.places, always=kept != self._kept)
        except OSError as problem:
            said = f"cannot record the search in {self._folder}: {problem}"
            if said not in self._reported:
                LOG.error("%s", said)
                self._reported.add(said)
        else:
            self._kept = kept
