"""Writes the map while frames are fused, so that a restarted mapper resumes it.

One checkpoint at a time is written, in a thread that lasts: each new one would keep memory of its
own. The mapper's lock is held for a part of the map at a time, so that fusing waits for a few
milliseconds.
"""
# Talks: writes in a thread, and logs.

from __future__ import annotations

import logging
import time
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from onemap_mapper import checkpoint_file
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.params import CheckpointParams
from onemap_mapper.storage.live_map import LiveMap
from onemap_mapper.storage.map_file import sweep_leftovers
from onemap_mapper.storage.snapshot import MapFileError, restore

LOG = logging.getLogger("onemap.mapper")


class Checkpoints:
    """The checkpoints of one mapper."""

    def __init__(self, folder: Path, params: CheckpointParams, live: LiveMap) -> None:
        self._folder, self._params, self._live = folder, params, live
        self._writer = ThreadPoolExecutor(1, "checkpoint")
        self._writing: Future[None] | None = None
        self._saved_revision = 0
        self._saved_s = time.monotonic()
        self._epoch = 0  # counts maps: a file of an earlier one must not stay
        self.problem = ""  # why none can be written, in one sentence
        self.written = 0
        self.write_ms = 0.0

    def poll(self, now_s: float) -> None:
        """Begin a checkpoint if one is due, at ``now_s`` on the monotonic clock.

        Raises what the last one raised unexpectedly.
        """
        since_s = now_s - self._saved_s
        if self._busy() or not self._params.checkpoint_interval_s:
            return
        if not self._params.may_be_due(since_s):
            return
        with self._live.lock:
            changed = self._changed_cells()
        if self._params.is_due(since_s, changed):
            self._saved_s = now_s
            self._writing = self._writer.submit(self._write)

    def replaced(self, *, due: bool) -> None:
        """Remove what was written: the map is another one. ``due``: write that one at once."""
        self._epoch += 1
        self._saved_revision = -1
        if due:
            self._saved_s = float("-inf")
        self._remove()

    def close(self) -> None:
        """Wait for a checkpoint that is being written; write the newest state."""
        self._writer.shutdown()
        if self._params.checkpoint_interval_s:
            self._write()

    def _busy(self) -> bool:
        """Whether one is being written."""
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
        """Write the map, unless it is empty or has not changed."""
        epoch, began_s = self._epoch, time.monotonic()
        with self._live.lock:
            changed, revision = self._changed_cells(), self._live.current().revision
        if not changed:
            return
        try:
            checkpoint_file.write(self._folder, self._live.write)
        except (OSError, MapFileError) as problem:
            self._report(f"cannot write a checkpoint: {problem}; a restart loses the map")
            return
        if epoch != self._epoch:  # cleared or loaded meanwhile: this was the map before
            self._remove()
            return
        self._saved_revision = revision
        self.problem, self.written = "", self.written + 1
        self.write_ms = (time.monotonic() - began_s) * 1e3

    def _remove(self) -> None:
        try:
            checkpoint_file.remove_all(self._folder)
        except OSError as problem:
            self._report(f"cannot remove old checkpoints: {problem}; a restart resumes an old map")

    def _report(self, problem: str) -> None:
        if problem != self.problem:
            LOG.error("%s", problem)
        self.problem = problem


def resumed(folder: Path, params: CheckpointParams) -> BeliefMap | None:
    """The map of the newest checkpoint that fits the configuration; what does not is logged.

    None without ``resume``; the mapper removes them with the first frame, if it is of their world.
    """
    if not params.resume:
        return None
    content, problems = checkpoint_file.newest(folder)
    for problem in problems:
        LOG.error("%s", problem)
    if content is None:
        return None
    try:
        belief = restore(content, params, encoder_id="", first_revision=0)
    except MapFileError as problem:
        LOG.error("the checkpoint is not resumed: %s", problem)
        return None
    LOG.info(
        "resumed %d cells of %d frames from a checkpoint", belief.store.count, belief.frames_fused
    )
    return belief


def sweep(folder: Path) -> None:
    """Remove what cut off writes of an earlier mapper left, of maps and of checkpoints."""
    for each in (folder, folder / checkpoint_file.FOLDER):
        try:
            count = sweep_leftovers(each)
        except OSError as problem:
            LOG.warning("cannot remove unfinished files in %s: %s", each, problem.strerror)
            continue
        if count:
            LOG.info("removed %d unfinished files in %s", count, each)
