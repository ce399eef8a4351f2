"""Virtual time: blocking code runs unchanged, one thread at a time, in an order drawn by the seed.

Each task is a thread of the interpreter, but only the one that was handed the turn runs; it hands
the turn on when it waits. When none can run, time moves to the next timer. So a run is a function
of its seed, and a minute of waiting takes no time.
"""

from __future__ import annotations

import heapq
import itertools
import random
import threading
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

SHORTEST_NS = 1000  # of a timer: a wait for a remainder of 1e-10 s would never let time pass
MAX_SWITCHES = 1_000_000  # at one instant, after which a loop that waits for no time is assumed
EPOCH_NS = 1_700_000_000 * 10**9  # wall clock at the begin


class Killed(BaseException):
    """The process is dead: raised at every call of it that reaches the world."""


class NoProgress(RuntimeError):
    """Tasks go on taking turns, but time stands still."""


@dataclass(eq=False)
class Process:
    """What is killed, stalled and started as a whole.

    skew_ns: of its wall clock; boot_ns: of its monotonic clock, without suspended_ns, for which its
    computer was suspended. on_crash: called with the name of a thread and what ended it.
    """

    name: str
    random: random.Random
    alive: bool = True
    stalled: bool = False
    skew_ns: int = 0
    boot_ns: int = 0
    suspended_ns: int = 0
    on_crash: Callable[[str, BaseException], object] | None = None
    frozen: list[Task] = field(default_factory=list)
    on_death: list[Callable[[], object]] = field(default_factory=list)
    belongings: dict[str, Any] = field(default_factory=dict)  # what ends with it, by kind


class Task:
    """A thread of a process, which runs while it has the turn."""

    def __init__(
        self, world: VirtualWorld, process: Process, name: str, work: Callable[[], Any]
    ) -> None:
        self.process, self.name, self._world, self._work = process, name, world, work
        self.turn = threading.Lock()
        self.turn.acquire()
        self.waiting = self.over = False
        self.woken, self.waits = "begins", 0
        self.joined: list[Task] = []  # who waits for its end
        self._thread = threading.Thread(target=self._run, name=f"{process.name} {name}")
        self._thread.daemon = True
        self._thread.start()

    def _run(self) -> None:
        self.turn.acquire()
        try:
            if self.process.alive:
                self._work()
        except Killed:
            pass
        except BaseException as problem:
            self._world.crashed(self, problem)
        self.over = True
        self._world.ended(self)


class VirtualWorld:
    """Scheduler and time. preempt: how probably a task lets others run where it need not wait."""

    def __init__(self, seed: int, *, preempt: float = 0.0) -> None:
        self.seed, self.preempt, self.rng = seed, preempt, random.Random(seed)
        self.now_ns = self.switches = self.trace = 0
        self.current: Task | None = None
        self.crashes: list[tuple[str, str, BaseException]] = []  # process, thread, what ended it
        self.processes: list[Process] = []
        self._tasks: list[Task] = []
        self._ready: list[Task] = []
        self._timers: list[tuple[int, int, Callable[[], object]]] = []
        self._count = itertools.count()
        self._until_ns, self._at_once, self._closing = 0, 0, False
        self._failure: BaseException | None = None
        self._main = threading.Lock()
        self._main.acquire()

    def process(self, name: str) -> Process:
        """A process without threads, and with random numbers of its own."""
        number = sum(each.name == name for each in self.processes)
        made = Process(name, random.Random(f"{self.seed} {name} {number}"))
        made.boot_ns = made.random.randrange(10**15)
        self.processes.append(made)
        return made

    def run(self, until_s: float, *, stop: Callable[[], bool] = lambda: False) -> None:
        """Run until this time, until ``stop``, which is asked at each timer, or until nothing is
        left to do. Raises what a timer raised."""
        self._until_ns, self._stop = int(until_s * 1e9), stop
        self._hand_on(self._next())
        self._main.acquire()
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure

    def close(self) -> None:
        """End every thread."""
        self._closing = True
        for process in self.processes:
            process.alive = False
        for task in self._tasks:
            if not task.over:
                self.current = task
                task.turn.release()
                self._main.acquire()
        self.current = None

    @property
    def now_s(self) -> float:
        """Seconds since the begin."""
        return self.now_ns * 1e-9

    def at(self, delay_s: float, fire: Callable[[], object]) -> None:
        """Call ``fire``, which must not wait, after this time."""
        due_ns = self.now_ns + max(int(delay_s * 1e9), SHORTEST_NS)
        heapq.heappush(self._timers, (due_ns, next(self._count), fire))

    def spawn(self, process: Process, name: str, work: Callable[[], Any]) -> Task:
        """Start a thread."""
        self.pass_by()
        task = Task(self, process, name, work)
        self._tasks.append(task)
        self._ready.append(task)
        return task

    def kill(self, process: Process) -> None:
        """As SIGKILL: no effect of it from now on."""
        if not process.alive:
            return
        process.alive = process.stalled = False
        process.frozen.clear()
        for tell in process.on_death:
            tell()

    def stall(self, process: Process, *, stalled: bool) -> None:
        """As SIGSTOP and SIGCONT."""
        process.stalled = stalled
        if not stalled:
            self._ready.extend(process.frozen)
            process.frozen.clear()

    def note(self, said: bytes) -> None:
        """Add what happened to the trace."""
        self.trace = zlib.crc32(said, self.trace)

    def pass_by(self) -> Task | None:
        """Called before each effect outside of a task; the task, None outside of any.

        Raises Killed in a dead process. Others may run meanwhile.
        """
        task = self.current
        if task is None:
            return None
        if not task.process.alive:
            raise Killed
        if self.preempt and self.rng.random() < self.preempt:
            task.woken = "gave way"
            self._ready.append(task)
            self._give_turn(task)
        return task

    def wait(self, timeout_s: float | None) -> bool:
        """Let others run until the task is woken; False if the time ran out."""
        task = self.current
        if task is None:
            raise RuntimeError("only a task may wait")
        if not task.process.alive:
            raise Killed
        task.waits += 1
        task.waiting = True
        if timeout_s is not None:
            self.at(timeout_s, partial(self._time_out, task, task.waits))
        self._give_turn(task)
        return task.woken == "woken"

    def wake(self, task: Task, why: str = "woken") -> None:
        """Let a waiting task run."""
        if task.waiting:
            task.waiting, task.woken = False, why
            self._ready.append(task)

    def crashed(self, task: Task, problem: BaseException) -> None:
        """A thread was ended by an exception."""
        process = task.process
        self.crashes.append((process.name, task.name, problem))
        if process.on_crash is not None and not self._closing:
            process.on_crash(task.name, problem)

    def ended(self, task: Task) -> None:
        """A thread is over."""
        for waiting in task.joined:
            self.wake(waiting)
        if self._closing:
            self._main.release()
        else:
            self._tasks.remove(task)
            self._hand_on(self._next())

    def _time_out(self, task: Task, waits: int) -> None:
        if task.waits == waits:
            self.wake(task, "timed out")

    def _give_turn(self, task: Task) -> None:
        """Hand the turn on, and return when it comes back."""
        following = self._next()
        if following is not task:
            self._hand_on(following)
            task.turn.acquire()
        self.current = task
        if not task.process.alive:
            raise Killed

    def _hand_on(self, task: Task | None) -> None:
        self.current = task
        (self._main if task is None else task.turn).release()

    def _next(self) -> Task | None:
        """Who runs now; None: nobody until ``run`` is called again."""
        self.current = None
        try:
            while (task := self._runnable()) is None:
                if not self._timers or self._timers[0][0] > self._until_ns or self._stop():
                    return None
                at_ns, _, fire = heapq.heappop(self._timers)
                if at_ns > self.now_ns:
                    self.now_ns, self._at_once = at_ns, 0
                fire()
        except BaseException as problem:
            self._failure = problem
            return None
        self.switches += 1
        self._at_once += 1
        if self._at_once > MAX_SWITCHES:
            self._failure = NoProgress(f"{task.process.name} {task.name}")
            return None
        self.note(f"{self.now_ns} {task.process.name} {task.name} {task.woken}".encode())
        return task

    def _runnable(self) -> Task | None:
        ready = self._ready
        while ready:
            index = self.rng.randrange(len(ready)) if len(ready) > 1 else 0
            task = ready.pop(index)
            if task.process.stalled:
                task.process.frozen.append(task)
            elif task.process.alive:
                return task
        return None
