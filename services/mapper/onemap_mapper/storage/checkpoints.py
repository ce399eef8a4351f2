"""Writes the map while frames are fused, so that a restarted mapper resumes it.

One checkpoint at a time is written, in a thread that lasts: each new one would keep memory of its
own. The mapper's lock is held for a part of the map at a time, so that fusing waits for a few
milliseconds.
"""
# Talks: writes in a thread, and logs.
# Touches files: checkpoints.

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.params import MapParams
from onemap_mapper.storage.map_file import SUFFIX, LiveMap, read
from onemap_mapper.storage.snapshot import MapFileError, MapSnapshot, restore
from onemap_shared.atomic_file import remove, sweep_leftovers
from onemap_shared.clock import Clock, Future
from onemap_shared.messages import Place

LOG = logging.getLogger("onemap.mapper")

FOLDER = "checkpoints"  # inside the map folder, so that they are not listed as maps
KEPT = 2  # so that one that cannot be read leaves another; numbered, as clocks may be set back
INTERVAL_S = 15.0  # after which a changed map is written: what a crash loses at most
# Changed cells after which it is written sooner: as many as ten frames of new floor change.
MANY_CELLS = 20_000
SOONER_S = INTERVAL_S / 3


def write_next(folder: Path, to_file: Callable[[Path], object]) -> Path:
    """Have ``to_file`` write the next checkpoint, then remove old ones; returns its path.

    Raises what ``to_file`` raises; then the old ones stay.
    """
    known = all_of(folder)
    path = folder / FOLDER / f"{_number(known[0]) + 1 if known else 1:08d}{SUFFIX}"
    to_file(path)
    for old in known[KEPT - 1 :]:
        remove(old)
    return path


def newest(folder: Path) -> tuple[MapSnapshot | None, list[str]]:
    """The newest checkpoint that can be read, and why newer ones cannot, a sentence each."""
    problems: list[str] = []
    for path in all_of(folder):
        try:
            return read(path), problems
        except MapFileError as problem:
            problems.append(f"checkpoint {path} cannot be used: {problem}")
    return None, problems


def remove_all(folder: Path) -> None:
    """Remove the checkpoints, because the map was replaced. Raises OSError."""
    for path in all_of(folder):
        remove(path)


def all_of(folder: Path) -> list[Path]:
    """All checkpoints, the newest first."""
    paths = (folder / FOLDER).glob(f"*{SUFFIX}")
    return sorted((path for path in paths if path.stem.isdecimal()), key=_number, reverse=True)


def _number(path: Path) -> int:
    return int(path.stem)


class Checkpoints:
    """The checkpoints of one mapper."""

    def __init__(
        self,
        folder: Path,
        live: LiveMap,
        clock: Clock,
        places: Callable[[], tuple[Place, ...]] = tuple,
    ) -> None:
        """places: those of now, of which a checkpoint tells that there were some."""
        self._folder, self._live, self._places = folder, live, places
        self._clock = clock
        self._writer = clock.pool(1, "checkpoint")
        self._writing: Future[None] | None = None
        self._saved_revision = 0
        self._saved_s = self._clock.monotonic_s()
        self._epoch = 0  # counts maps: a file of an earlier one must not stay
        self.problem = ""  # why none can be written, in one sentence
        self.written = 0
        self.write_ms = 0.0

    def poll(self, now_s: float) -> None:
        """Begin a checkpoint if one is due, at ``now_s`` on the monotonic clock.

        Raises what the last one raised unexpectedly.
        """
        since_s = now_s - self._saved_s
        if self._busy() or since_s < SOONER_S:
            return
        with self._live.lock:
            changed = self._changed_cells()
        if changed and (since_s >= INTERVAL_S or changed >= MANY_CELLS):
            self._saved_s = now_s
            self._writing = self._writer.submit(self._write)

    def replaced(self, *, due: bool) -> None:
        """Remove what was written: the map is another one. ``due``: write that one at once."""
        self._epoch += 1
        self._saved_revision = -1
        if due:
            self.hurry()
        self._remove()

    def hurry(self) -> None:
        """Write at once: much has changed. What was written stays until then."""
        self._saved_s = float("-inf")

    def flush(self) -> None:
        """Write what changed since the last checkpoint, and return when it is written."""
        if self._writing is not None:
            self._writing.result()
            self._writing = None
        self._write()

    def close(self) -> None:
        """Wait for a checkpoint that is being written; write the newest state."""
        self._writer.shutdown()
        self._write()

    def _busy(self) -> bool:
        if self._writing is None or not self._writing.done():
            return self._writing is not None
        ended, self._writing = self._writing, None
        ended.result()
        return False

    def _changed_cells(self) -> int:
        """Cells that changed since the last checkpoint; 1 if only something else did."""
        belief = self._live.current()
        if belief.dimension == 0 or belief.revision == self._saved_revision:
            return 0
        return max(int((belief.store.changed_at > self._saved_revision).sum()), 1)

    def _write(self) -> None:
        epoch, began_s = self._epoch, self._clock.monotonic_s()
        with self._live.lock:
            changed, revision = self._changed_cells(), self._live.current().revision
        if not changed:
            return
        try:
            write_next(self._folder, lambda path: self._live.write(path, places=self._places()))
        except (OSError, MapFileError) as problem:
            self._report(f"cannot write a checkpoint: {problem}; a restart loses the map")
            return
        if epoch != self._epoch:  # cleared or loaded meanwhile: this was the map before
            self._remove()
            return
        self._saved_revision = revision
        self.problem, self.written = "", self.written + 1
        self.write_ms = (self._clock.monotonic_s() - began_s) * 1e3

    def _remove(self) -> None:
        try:
            remove_all(self._folder)
        except OSError as problem:
            self._report(f"cannot remove old checkpoints: {problem}; a restart resumes an old map")

    def _report(self, problem: str) -> None:
        if problem != self.problem:
            LOG.error("%s", problem)
        self.problem = problem


def resumed(folder: Path, params: MapParams) -> tuple[BeliefMap | None, tuple[Place, ...]]:
    """The map of the newest checkpoint, if it fits the configuration, and its places.

    What does not fit is logged.
    """
    content, problems = newest(folder)
    for problem in problems:
        LOG.error("%s", problem)
    if content is None:
        return None, ()
    try:
        belief = restore(content, params, encoder_id="", first_revision=0)
    except MapFileError as problem:
        LOG.error("the checkpoint is not resumed: %s", problem)
        return None, content.places
    LOG.info(
        "resumed %d cells of %d frames from a checkpoint", belief.store.count, belief.frames_fused
    )
    return belief, content.places


def sweep(folder: Path) -> None:
    """Remove what cut off writes of an earlier mapper left, of maps and of checkpoints."""
    for each in (folder, folder / FOLDER):
        try:
            count = sweep_leftovers(each)
        except OSError as problem:
            LOG.warning("cannot remove unfinished files in %s: %s", each, problem.strerror)
            continue
        if count:
            LOG.info("removed %d unfinished files in %s", count, each)
