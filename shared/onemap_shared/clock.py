"""Time, waiting, threads and random numbers, as an argument.

Services read no clock, wait for nothing and start no thread but through a ``Clock``, which their
bus carries. So they run unchanged in a process and in virtual time. ``SystemClock`` is the one of
a process.
"""
# Talks: clocks and threads; only this module imports them, beside what drives Zenoh.

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from concurrent import futures
from types import TracebackType
from typing import Any, ParamSpec, Protocol, TypeVar

Future = futures.Future
P = ParamSpec("P")
T = TypeVar("T")


class Event(Protocol):
    """As ``threading.Event``."""

    def is_set(self) -> bool: ...

    def set(self) -> None: ...

    def clear(self) -> None: ...

    def wait(self, timeout: float | None = None) -> bool: ...


class Lock(Protocol):
    """As ``threading.Lock`` and ``threading.RLock``."""

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool: ...

    def release(self) -> None: ...

    def __enter__(self) -> bool: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None: ...


class Condition(Protocol):
    """As ``threading.Condition`` with a lock of its own."""

    def wait(self, timeout: float | None = None) -> bool: ...

    def wait_for(self, predicate: Callable[[], T], timeout: float | None = None) -> T: ...

    def notify(self, n: int = 1) -> None: ...

    def notify_all(self) -> None: ...

    def __enter__(self) -> bool: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None: ...


class Thread(Protocol):
    """A thread that was started; it does not keep its process alive."""

    def is_alive(self) -> bool: ...

    def join(self, timeout: float | None = None) -> None: ...


class Pool(Protocol):
    """Threads that carry out what is submitted, in that order."""

    def submit(self, work: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]: ...

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None: ...


class Clock(Protocol):
    """Time of one process, and everything in it that waits."""

    @property
    def random(self) -> random.Random:
        """For ids and pauses that are drawn."""

    def monotonic_s(self) -> float:
        """Seconds since a moment that only this computer knows; never goes back."""

    def wall_ns(self) -> int:
        """Nanoseconds since 1970, as this computer believes; may jump."""

    def suspended_s(self) -> float:
        """Seconds since its start for which the computer was suspended; 0 where no system tells."""

    def sleep(self, seconds: float) -> None: ...

    def event(self) -> Event: ...

    def lock(self) -> Lock: ...

    def rlock(self) -> Lock:
        """A lock that its owner may take again."""

    def condition(self) -> Condition: ...

    def future(self) -> Future[Any]:
        """A result that another thread will set."""

    def thread(self, name: str, work: Callable[[], object]) -> Thread:
        """Start a thread."""

    def pool(self, threads: int, name: str) -> Pool: ...

    def on_dead_thread(self, report: Callable[[str, BaseException], object]) -> None:
        """Call ``report`` with the name of every thread that an exception ends, and with that."""


class SystemClock:
    """The clock and the threads of this process. Implements ``Clock``."""

    random: random.Random = random.SystemRandom()

    def monotonic_s(self) -> float:
        """See ``Clock``."""
        return time.monotonic()

    def wall_ns(self) -> int:
        """See ``Clock``."""
        return time.time_ns()

    def suspended_s(self) -> float:
        """See ``Clock``."""
        if not hasattr(time, "CLOCK_BOOTTIME"):
            return 0.0
        return time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC)

    def sleep(self, seconds: float) -> None:
        """See ``Clock``."""
        time.sleep(seconds)

    def event(self) -> threading.Event:
        """See ``Clock``."""
        return threading.Event()

    def lock(self) -> Lock:
        """See ``Clock``."""
        return threading.Lock()

    def rlock(self) -> Lock:
        """See ``Clock``."""
        return threading.RLock()

    def condition(self) -> threading.Condition:
        """See ``Clock``."""
        return threading.Condition()

    def future(self) -> Future[Any]:
        """See ``Clock``."""
        return Future()

    def thread(self, name: str, work: Callable[[], object]) -> threading.Thread:
        """See ``Clock``."""
        thread = threading.Thread(target=work, name=name, daemon=True)
        thread.start()
        return thread

    def pool(self, threads: int, name: str) -> futures.ThreadPoolExecutor:
        """See ``Clock``."""
        return futures.ThreadPoolExecutor(threads, name)

    def on_dead_thread(self, report: Callable[[str, BaseException], object]) -> None:
        """See ``Clock``."""

        def handle(died: threading.ExceptHookArgs) -> None:
            problem = died.exc_value or died.exc_type()
            report(died.thread.name if died.thread else "a thread", problem)

        threading.excepthook = handle
