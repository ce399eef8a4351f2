"""Signal handling: the first Ctrl-C stops cleanly, the second at once."""
# Talks: signals of the process.

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stop(threading.Event):
    """Set by the first signal, which also ends what runs in ``breaking``."""

    _breaks = False

    @contextmanager
    def breaking(self) -> Iterator[None]:
        """What may be left undone at a signal, such as waiting for an answer."""
        self._breaks = True
        with suppress(KeyboardInterrupt):
            try:
                yield
            finally:
                self._breaks = False

    def signalled(self) -> None:
        """Set it; raises KeyboardInterrupt in ``breaking``."""
        self.set()
        if self._breaks:
            raise KeyboardInterrupt


@contextmanager
def interruptible(abandon: Callable[[], None] = lambda: None) -> Iterator[Stop]:
    """An event that the first signal sets; the second calls ``abandon`` and exits at once."""
    stop = Stop()

    def handle(signum: int, _frame: FrameType | None) -> None:
        if stop.is_set():
            abandon()
            os._exit(128 + signum)
        stop.signalled()

    before = {signum: signal.signal(signum, handle) for signum in SIGNALS}
    try:
        yield stop
    finally:
        for signum, handler in before.items():
            signal.signal(signum, handler)
