"""A ``Clock`` of one process in virtual time: events, locks, conditions, pools."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any, NoReturn, ParamSpec, TypeVar

from onemap_shared.clock import Future
from onemap_tools.virtual.scheduler import EPOCH_NS, Process, Task, VirtualWorld

P = ParamSpec("P")
T = TypeVar("T")


class VirtualEvent:
    """As ``threading.Event``."""

    def __init__(self, world: VirtualWorld) -> None:
        self._world, self._set, self._waiters = world, False, deque[Task]()

    def is_set(self) -> bool:
        return self._set

    def set(self) -> None:
        self._world.pass_by()
        self._set = True
        while self._waiters:
            self._world.wake(self._waiters.popleft())

    def clear(self) -> None:
        self._set = False

    def wait(self, timeout: float | None = None) -> bool:
        task = self._world.pass_by()
        if not self._set and (timeout is None or timeout > 0) and task is not None:
            self._waiters.append(task)
            if self._world.wait(timeout):
                return True  # though it was cleared since
            if task in self._waiters:
                self._waiters.remove(task)
        return self._set


class VirtualLock:
    """As ``threading.Lock``; ``again``: as ``threading.RLock``."""

    def __init__(self, world: VirtualWorld, *, again: bool) -> None:
        self._world, self._again, self._waiters = world, again, list[Task]()
        self._owner: Task | None = None
        self._count = 0

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        task = self._world.pass_by()
        if self._count == 0 or (self._again and self._owner is task):
            self._owner = task
            self._count += 1
            return True
        if not blocking:
            return False
        if task is None:
            raise RuntimeError("a lock is held by a task")
        self._waiters.append(task)
        self._world.wait(None if timeout < 0 else timeout)
        if task not in self._waiters:  # else it was handed over
            return True
        self._waiters.remove(task)
        return False

    def release(self) -> None:
        if not (self.held if self._again else self._count):
            self._refuse()
        self._count -= 1
        if self._count > 0:
            return
        self._owner = None
        if self._waiters:
            index = self._world.rng.randrange(len(self._waiters))
            self._owner, self._count = self._waiters.pop(index), 1
            self._world.wake(self._owner)

    @property
    def held(self) -> bool:
        """Whether the present task holds it."""
        return self._count > 0 and self._owner is self._world.current

    def check_held(self) -> None:
        """Raises RuntimeError unless the present task holds it."""
        if not self.held:
            self._refuse()

    def _refuse(self) -> NoReturn:
        self._world.pass_by()  # the dead, who gave it up when they waited, end here
        raise RuntimeError("the lock is not held")

    def release_all(self) -> int:
        """Release it however often it was acquired; returns that."""
        count, self._count = self._count, 1
        self.release()
        return count

    def take_back(self, count: int) -> None:
        """Acquire it that often."""
        self.acquire()
        self._count = count

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None:
        self.release()


class VirtualCondition:
    """As ``threading.Condition``."""

    def __init__(self, world: VirtualWorld) -> None:
        self._world, self._lock = world, VirtualLock(world, again=True)
        self._waiters = deque[Task]()

    def wait(self, timeout: float | None = None) -> bool:
        self._lock.check_held()
        task = self._world.current
        if task is None:
            return False
        count = self._lock.release_all()
        self._waiters.append(task)
        self._world.wait(timeout)
        notified = task not in self._waiters
        if not notified:
            self._waiters.remove(task)
        self._lock.take_back(count)
        return notified

    def wait_for(self, predicate: Callable[[], T], timeout: float | None = None) -> T:
        end_s = None if timeout is None else self._world.now_s + timeout
        while not (result := predicate()):
            left_s = None if end_s is None else end_s - self._world.now_s
            if left_s is not None and left_s <= 0:
                break
            self.wait(left_s)
        return result

    def notify(self, n: int = 1) -> None:
        self._lock.check_held()
        self._world.pass_by()
        for _ in range(min(n, len(self._waiters))):
            self._world.wake(self._waiters.popleft())

    def notify_all(self) -> None:
        self.notify(len(self._waiters))

    def __enter__(self) -> bool:
        return self._lock.acquire()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None:
        self._lock.release()


class VirtualFuture(Future[Any]):
    """A ``concurrent.futures.Future`` that is waited for in virtual time."""

    def __init__(self, world: VirtualWorld) -> None:
        super().__init__()
        self._condition = VirtualCondition(world)  # type: ignore[assignment]


class VirtualThread:
    """As ``threading.Thread``."""

    def __init__(self, world: VirtualWorld, task: Task) -> None:
        self._world, self._task = world, task

    def is_alive(self) -> bool:
        return not self._task.over

    def join(self, timeout: float | None = None) -> None:
        task = self._world.pass_by()
        if task is not None and not self._task.over and (timeout is None or timeout > 0):
            self._task.joined.append(task)
            if not self._world.wait(timeout):
                self._task.joined.remove(task)


class VirtualPool:
    """As ``ThreadPoolExecutor``: a thread is started when none is idle."""

    def __init__(self, clock: VirtualClock, threads: int, name: str) -> None:
        self._clock, self._most, self._name = clock, threads, name
        self._work = deque[tuple[VirtualFuture, Callable[[], object]]]()
        self._changed = clock.condition()
        self._started = self._idle = 0
        self._closed = False

    def submit(self, work: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        future = self._clock.future()
        with self._changed:
            if self._closed:
                raise RuntimeError("cannot schedule new futures after shutdown")
            self._work.append((future, lambda: work(*args, **kwargs)))
            if self._idle >= len(self._work) or self._started == self._most:
                self._changed.notify()
                return future
            self._started += 1
        self._clock.thread(f"{self._name} {self._started}", self._run)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        with self._changed:
            self._closed = True
            if cancel_futures:
                for future, _ in self._work:
                    future.cancel()
                self._work.clear()
            self._changed.notify_all()
            if wait:
                self._changed.wait_for(lambda: self._started == 0)

    def _run(self) -> None:
        while (taken := self._next()) is not None:
            future, work = taken
            if not future.set_running_or_notify_cancel():
                continue
            try:
                result = work()
            except Exception as problem:
                future.set_exception(problem)
            else:
                future.set_result(result)
            del future, work, taken

    def _next(self) -> tuple[VirtualFuture, Callable[[], object]] | None:
        with self._changed:
            self._idle += 1
            self._changed.wait_for(lambda: self._work or self._closed)
            self._idle -= 1
            if self._work:
                return self._work.popleft()
            self._started -= 1
            self._changed.notify_all()
            return None


class VirtualClock:
    """The clock of a process. Implements ``Clock``."""

    def __init__(self, world: VirtualWorld, process: Process) -> None:
        self.world, self.process = world, process

    @property
    def random(self) -> random.Random:
        return self.process.random

    def monotonic_s(self) -> float:
        process = self.process
        return (self.world.now_ns + process.boot_ns - process.suspended_ns) * 1e-9

    def wall_ns(self) -> int:
        return EPOCH_NS + self.world.now_ns + self.process.skew_ns

    def suspended_s(self) -> float:
        return self.process.suspended_ns * 1e-9

    def sleep(self, seconds: float) -> None:
        self.world.wait(seconds)

    def event(self) -> VirtualEvent:
        return VirtualEvent(self.world)

    def lock(self) -> VirtualLock:
        return VirtualLock(self.world, again=False)

    def rlock(self) -> VirtualLock:
        return VirtualLock(self.world, again=True)

    def condition(self) -> VirtualCondition:
        return VirtualCondition(self.world)

    def future(self) -> VirtualFuture:
        return VirtualFuture(self.world)

    def thread(self, name: str, work: Callable[[], object]) -> VirtualThread:
        return VirtualThread(self.world, self.world.spawn(self.process, name, work))

    def pool(self, threads: int, name: str) -> VirtualPool:
        return VirtualPool(self, threads, name)

    def on_dead_thread(self, report: Callable[[str, BaseException], object]) -> None:
        self.process.on_crash = report
