"""The log of a process: lines on stderr, written by a thread of its own.

Nothing that logs waits for the disk or the pipe that takes the lines: the planner's control loop
logs, and a loop that waits sends no velocities. What does not fit into the queue is left out and
counted.
"""
# Talks: stderr, from a thread.

from __future__ import annotations

import copy
import json
import logging
from collections.abc import Callable
from logging.handlers import QueueHandler, QueueListener
from queue import Full, Queue

from onemap_shared.clock import SystemClock
from onemap_shared.config import LogConfig
from onemap_shared.supervisor import with_priorities

CLOCK = SystemClock()  # of what writes, whatever the clock of what logs
QUEUED = 1000  # records; services log a few in a second
FLUSH_S = 1.0  # for what is queued at the end of a process: its reader may hang


class JsonFormatter(logging.Formatter):
    """One JSON object a line."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as JSON with stamp_ns, level, logger, message and traceback if any."""
        entry = {
            "stamp_ns": int(record.created * 1e9),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_text:
            entry["traceback"] = record.exc_text
        return json.dumps(entry)


class BoundedQueueHandler(QueueHandler):
    """Queues records without waiting; counts those that do not fit."""

    queue: Queue[logging.LogRecord]

    def __init__(self) -> None:
        super().__init__(Queue(QUEUED))
        # Since it was last taken. The handler's own lock is held by who waits for the writer.
        self._lost, self._lost_lock = 0, CLOCK.lock()

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        """The record as text: what its arguments and its traceback hold may change, or be large."""
        plain = copy.copy(record)
        plain.msg, plain.args = record.getMessage(), ()
        if record.exc_info:
            plain.exc_text = logging.Formatter().formatException(record.exc_info)
            plain.exc_info = None
        return plain

    def enqueue(self, record: logging.LogRecord) -> None:
        """Queue a record, or count it."""
        try:
            self.queue.put_nowait(record)
        except Full:
            with self._lost_lock:
                self._lost += 1

    def take_lost(self) -> int:
        """How many records did not fit since the last call."""
        with self._lost_lock:
            lost, self._lost = self._lost, 0
        return lost

    def flush(self, timeout_s: float = FLUSH_S) -> None:
        """Wait until all that is queued was written, at most ``timeout_s``."""
        with self.queue.all_tasks_done:
            self.queue.all_tasks_done.wait_for(lambda: self.queue.unfinished_tasks == 0, timeout_s)


class LogWriter(QueueListener):
    """Writes the queued records; says how many were lost once the queue is empty again."""

    def __init__(self, source: BoundedQueueHandler, target: logging.Handler) -> None:
        super().__init__(source.queue, target)
        self._source = source

    def handle(self, record: logging.LogRecord) -> None:
        """Write a record."""
        super().handle(record)
        if self._source.queue.empty() and (lost := self._source.take_lost()):
            text = f"{lost} lines of this log are missing: they came faster than it was written"
            level = logging.WARNING
            super().handle(logging.LogRecord(__name__, level, __file__, 0, text, (), None))


def set_up_logging(config: LogConfig, service: str) -> None:
    """Log to stderr: what a person reads, or one JSON object a line."""
    writer = logging.StreamHandler()
    if config.format == "json":
        formatter: logging.Formatter = JsonFormatter()
    else:
        layout = f"%(asctime)s %(levelname)-7s {service}: %(message)s"
        formatter = logging.Formatter(layout, datefmt="%H:%M:%S")
    writer.setFormatter(with_priorities(formatter))
    handler = BoundedQueueHandler()
    handler.addFilter(LogLimit())
    LogWriter(handler, writer).start()
    logging.basicConfig(level=config.level.upper(), handlers=[handler], force=True)


def flush_log() -> None:
    """Wait, for at most ``FLUSH_S``, until all that was logged so far is written."""
    for handler in logging.getLogger().handlers:
        if isinstance(handler, BoundedQueueHandler):
            handler.flush()


PERIOD_S = 10.0  # between two lines of one kind
MAX_KINDS = 256  # of which the last line is remembered
MAX_CHARS = 1000  # of one line, without its traceback


class LogLimit(logging.Filter):
    """One line every ``PERIOD_S`` of each kind of warning and failure, with how many were left out.

    A kind is a logger with an unformatted text. Errors without a traceback always pass: they are
    about this process and rare, and two of them may share a text.
    """

    def __init__(self, clock_s: Callable[[], float] = CLOCK.monotonic_s) -> None:
        super().__init__()
        self._clock_s = clock_s
        self._last_s: dict[tuple[str, str], float] = {}
        self._left_out: dict[tuple[str, str], int] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether to log; cuts the text, and adds the number of lines that were left out."""
        text = record.getMessage()
        if record.levelno == logging.WARNING or (
            record.levelno == logging.ERROR and record.exc_info
        ):
            kind, now_s = (record.name, str(record.msg)), self._clock_s()
            if now_s - self._last_s.get(kind, -PERIOD_S) < PERIOD_S:
                self._left_out[kind] = self._left_out.get(kind, 0) + 1
                return False
            self._last_s.pop(kind, None)
            self._last_s[kind] = now_s
            while len(self._last_s) > MAX_KINDS:
                oldest = next(iter(self._last_s))
                del self._last_s[oldest]
                self._left_out.pop(oldest, None)
            left_out = self._left_out.pop(kind, 0)
            text = text[:MAX_CHARS] + (f" (and {left_out} more before)" if left_out else "")
        record.msg, record.args = text[: MAX_CHARS + 50], ()
        return True
