"""Bounds what a process logs: whoever sends bad messages must not fill the disk."""
# Talks: a filter of the log.

from __future__ import annotations

import logging
import time
from collections.abc import Callable

PERIOD_S = 10.0  # between two lines of one kind
MAX_KINDS = 256  # of which the last line is remembered
MAX_CHARS = 1000  # of one line, without its traceback


class LogLimit(logging.Filter):
    """One line every ``PERIOD_S`` of each kind of warning and failure, with how many were left out.

    A kind is a logger with an unformatted text. Errors without a traceback always pass: they are
    about this process and rare, and two of them may share a text.
    """

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
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
