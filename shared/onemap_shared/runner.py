"""Runs a service process: configuration, logging, bus, heartbeat, signals, systemd.

Says on the bus that the process starts while the service is still imported, then calls the
worker's ``step`` in a loop and publishes its health once a second. When any thread dies, or the
loop hangs, the process ends: the supervisor's restart is the recovery.
"""
# Talks: the process around a worker.

from __future__ import annotations

import argparse
import faulthandler
import gc
import itertools
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, Generic, NoReturn, Protocol, TypeVar

from pydantic import BaseModel

from onemap_shared.bus import open_bus
from onemap_shared.clock import Clock, Event, Future, SystemClock
from onemap_shared.compression import CompressionError
from onemap_shared.config import BusConfig, ConfigError, LogConfig, Sections, read, section
from onemap_shared.keys import heartbeat
from onemap_shared.log import flush_log, set_up_logging
from onemap_shared.messages import START_METRIC, Heartbeat
from onemap_shared.services import SOLE, installed_version, role_of
from onemap_shared.supervisor import Supervisor
from onemap_shared.tls_files import UnreadableFile
from onemap_shared.transport import Bus, Health, Publisher, Worker
from onemap_shared.watchdog import LoopProgress, watch

C = TypeVar("C", bound=BaseModel)
LOG = logging.getLogger("onemap.runner")

STEP_S = 0.1  # longest wait inside a step, and so the delay to notice a signal
HEARTBEAT_S = 1.0
READY_POLL_S = 0.1  # until it is told that a worker is ready now: a start waits for each of them
PARENT_VARIABLE = "ONEMAP_PARENT_PID"  # set by a launcher to its own process id
HANG_S = 10.0  # a loop without progress for this long hangs: stop feeding systemd's watchdog
CLAIM_S = 4.0  # the process before is gone by then: a dead link is noticed after 2 s
CLAIM_RETRY_S = (0.2, 0.6)  # drawn, so that two at the same time do not meet again
START_LIMIT_S = 300.0  # TimeoutStartSec: a start that takes longer has to say what takes so long
EXIT_OK, EXIT_CRASHED, EXIT_MISUSED = 0, 1, 2
STARTING = "it is starting"  # what a start says that does not say what takes so long


class StartError(Exception):
    """The service cannot start as configured; the text is one sentence for the user.

    ``temporary``: it may start later as it is configured, as when a port is in use.
    """

    def __init__(self, sentence: str, *, temporary: bool = False) -> None:
        super().__init__(sentence)
        self.temporary = temporary


class WorkerFailed(Exception):
    """The worker cannot go on, but a new process may; the text is one sentence for the user."""


# Seconds for which a thread that computes keeps the interpreter from those that wait. At Python's
# 0.005 a query, which passes five threads of a mapper that fuses, waits for that at each; at 0.0003
# the slowest queries take longer again.
SWITCH_S = 0.001


@dataclass(frozen=True, slots=True)
class ServiceParts(Generic[C]):
    """A service as its process runs it: the model of its section, and what builds its worker.

    ``check`` looks at what the configuration names, such as files, without the bus; it and
    ``build`` may raise StartError. ``section``: of the configuration, where it is not called as
    the service is.
    """

    model: type[C]
    build: Callable[[Bus, C], Worker]
    check: Callable[[C], None] = lambda _: None
    section: str = ""


def run_service(
    service: str,
    load: Callable[[StartReport], ServiceParts[Any]],
    arguments: list[str] | None = None,
) -> NoReturn:
    """Run a service until SIGTERM or SIGINT, and end the process.

    ``load`` imports the service, which takes seconds, and a minute on a machine that is busy:
    meanwhile the process is on the bus and says so. Exit code 0 after a signal, 1 after a crash or
    when it cannot start now, 2 when it cannot start as configured.

    The process ends without Python's own end, which waits for every thread and frees every
    object: of a large map on a busy machine that took longer than a supervisor waits.
    """
    parser = argparse.ArgumentParser(prog=f"onemap {service}")
    parser.add_argument("--config", type=Path, help="YAML file; defaults apply without it")
    options = parser.parse_args(arguments)
    code = EXIT_CRASHED
    try:
        sections = read(options.config)
    except ConfigError as problem:  # nothing has begun yet
        print(f"{service}: {problem}", file=sys.stderr)
        raise SystemExit(EXIT_MISUSED) from problem
    try:
        code = _run(service, load, sections)
    except ConfigError as problem:
        print(f"{service}: {problem}", file=sys.stderr)
        code = EXIT_MISUSED
    except StartError as problem:
        LOG.error("%s", problem)
        code = EXIT_CRASHED if problem.temporary else EXIT_MISUSED
    except ModuleNotFoundError:  # of an extra that is not installed: the command says which
        raise
    except Exception:
        LOG.exception("%s crashed", service)
    flush_log()
    with suppress(OSError, ValueError):
        sys.stdout.flush()
    os._exit(code)


def _run(service: str, load: Callable[[StartReport], ServiceParts[Any]], sections: Sections) -> int:
    """Join the bus, import the service, work until a signal; returns the exit code."""
    set_up_logging(section(sections, "log", LogConfig), service)
    faulthandler.enable()  # systemd's watchdog sends SIGABRT: say where each thread stands
    sys.setswitchinterval(SWITCH_S)
    clock = SystemClock()
    life = ProcessLife(service, clock)
    _stop_on_signals(life)
    watch_parent(life.stop)
    watch(service, life.progress, life.stop)  # to the end of the process: what follows may hang too

    def imported(start: StartReport) -> ServiceParts[Any]:
        gc.disable()  # imports leave no garbage, and looking for it is a tenth of them
        parts = load(start)
        gc.freeze()  # what was imported stays: garbage is looked for among the rest only
        gc.enable()
        return parts

    return serve(life, imported, sections, partial(open_bus, announce=False))


class JoiningBus(Bus, Protocol):
    """A bus on which nobody sees this process before it says so."""

    def announce(self) -> None:
        """Show this process to the others, as long as it is connected."""


class Connect(Protocol):
    """Connects to the router; see ``bus.open_bus``."""

    def __call__(
        self,
        config: BusConfig,
        service: str,
        instance: str,
        stop: Event,
        *,
        waiting: Callable[[str], None],
    ) -> JoiningBus | None:
        """The bus; None if ``stop`` was set before the router answered."""


class ProcessLife:
    """What ends the process of a service: ``stop``, and ``crashed`` when one of its threads died.

    imported: set once the service is; built: once its worker is, which has to be closed.
    progress: of its main loop.
    """

    def __init__(self, service: str, clock: Clock) -> None:
        self.service, self.clock, self.progress = service, clock, LoopProgress()
        self.stop, self.crashed = clock.event(), clock.event()
        self.imported, self.built = clock.event(), clock.event()
        clock.on_dead_thread(self._died)

    def _died(self, name: str, problem: BaseException) -> None:
        LOG.critical("%s died", name, exc_info=problem)
        self.crashed.set()
        self.stop.set()


def serve(
    life: ProcessLife,
    load: Callable[[StartReport], ServiceParts[Any]],
    sections: Sections,
    connect: Connect,
) -> int:
    """Join the bus, import the service, work until ``life.stop``; returns the exit code."""
    config = section(sections, "bus", BusConfig)
    start = Start(life, config, connect)
    try:
        parts = load(start.report)
        settings = section(sections, parts.section or life.service, parts.model)
        parts.check(settings)
        life.imported.set()
        bus = start.joined()
        if bus is None:
            stopped = life.stop.is_set() and not life.crashed.is_set()
            return EXIT_OK if stopped else EXIT_CRASHED
        worker = parts.build(bus, settings)
        life.built.set()
        start.end()
        code = _work(HeartbeatPublisher(life.service, bus, life.progress), worker, life.stop)
    except UnreadableFile as problem:
        raise StartError(str(problem)) from problem
    except CompressionError as problem:  # of bus.link, by the first topic that needs it
        raise StartError(f"what it sends {problem}") from problem
    finally:
        life.stop.set()
        start.close()
    return EXIT_CRASHED if life.crashed.is_set() else code


class StartReport:
    """What a process says of its start, on the bus and to systemd. Any thread may use it."""

    def __init__(self, service: str, clock: Clock) -> None:
        self._service, self.clock, self._supervisor = service, clock, Supervisor()
        self._publishers: tuple[tuple[Bus, Publisher[Heartbeat]], ...] = ()
        self._joined_s = clock.monotonic_s()
        self._long: tuple[str, float, float] | None = None  # what, usual seconds, since when
        self._count = itertools.count(1)

    def add(self, bus: Bus) -> None:
        """Say it on this bus as well from now on: the first, or one of a further robot's keys."""
        if not self._publishers:
            self._joined_s = self.clock.monotonic_s()
        self._publishers += ((bus, bus.publish(heartbeat(self._service))),)
        self.publish()

    @contextmanager
    def takes(self, what: str, usual_s: float) -> Iterator[None]:
        """Say what takes long, a sentence, and for how long usually, until the block ends.

        systemd is asked for more time, so that it does not end what advances.
        """
        self._long = (what, usual_s, self.clock.monotonic_s())
        self.publish()
        try:
            yield
        finally:
            self._long = None

    def publish(self) -> None:
        """Publish that the service is not ready, and why; to be called once a second.

        The progress counts the calls: the main loop has not begun yet.
        """
        now_s = self.clock.monotonic_s()
        so_far_s, long = now_s - self._joined_s, self._long
        problem = f"{STARTING}, for {so_far_s:.0f} s so far"
        if long is not None:
            what, usual_s, since_s = long
            problem = f"{what}: {now_s - since_s:.0f} of about {usual_s:.0f} s"
        if long is not None or so_far_s < START_LIMIT_S:
            self._supervisor.starting(problem, longer=long is not None)
        health = Health(False, problem, {START_METRIC: so_far_s})
        count = next(self._count)
        for bus, publisher in self._publishers:
            publisher.put(_heartbeat(self._service, bus, count, health))


class Start:
    """Joins the bus in a thread, and reports there once a second that the process starts.

    Once the service is imported the process works, though its router may come hours later: that is
    what systemd is told.
    """

    def __init__(self, life: ProcessLife, config: BusConfig, connect: Connect) -> None:
        clock = life.clock
        self.report = StartReport(life.service, clock)
        self._life, self._config, self._connect = life, config, connect
        self._joined, self._over = clock.event(), clock.event()
        self._bus: Future[JoiningBus | None] = clock.future()
        self._thread = clock.thread("start", self._run)

    def joined(self) -> JoiningBus | None:
        """Wait for the bus; None on stop, or if another process has this role.

        Raises UnreadableFile for a certificate or key that cannot be read.
        """
        while not self._joined.wait(STEP_S):  # not for ever: another thread may receive the signal
            pass
        return self._bus.result()

    def end(self) -> None:
        """Report no more: the start is over."""
        self._over.set()
        self._thread.join(2 * HEARTBEAT_S)

    def close(self) -> None:
        """Leave the bus."""
        self.end()
        if self._bus.done() and self._bus.exception() is None and (bus := self._bus.result()):
            bus.close()

    def _run(self) -> None:
        try:
            bus = self._join()
            if bus is not None:
                self.report.add(bus)
        except Exception as problem:
            self._bus.set_exception(problem)
            return
        else:
            self._bus.set_result(bus)
        finally:
            self._joined.set()
        while bus is not None and not self._over.wait(HEARTBEAT_S) and not self._life.stop.is_set():
            self.report.publish()

    def _join(self) -> JoiningBus | None:
        life, supervisor = self._life, Supervisor()
        instance = life.clock.random.randbytes(6).hex()

        def waiting(what: str) -> None:
            if life.imported.is_set():
                supervisor.alive(ready=False, status=what)
            else:
                supervisor.starting(what)

        bus = self._connect(self._config, life.service, instance, life.stop, waiting=waiting)
        if bus is not None and not _joined_alone(bus, life.service, life.stop):
            bus.close()
            return None
        return bus


def _joined_alone(bus: JoiningBus, service: str, stop: Event) -> bool:
    """Announce the service; False if another process has its role for ``CLAIM_S``, or on stop.

    Exit code 1 then, not 2: a supervisor that tries again takes over when the other ends.
    """
    if role_of(service) not in SOLE:
        bus.announce()
        return True
    clock = bus.clock
    deadline = clock.monotonic_s() + CLAIM_S
    others: tuple[str, ...] = ()
    while clock.monotonic_s() < deadline:
        try:
            others = bus.claim()
        except ConnectionError:  # nobody can be asked: wait for the router, and then as long again
            deadline = clock.monotonic_s() + CLAIM_S
        else:
            if not others:
                return True
        if stop.wait(clock.random.uniform(*CLAIM_RETRY_S)):
            return False
    LOG.error(
        "the %s is not started: %s runs on these keys; stop it first, or give this robot a "
        "bus.namespace of its own",
        service,
        ", ".join(others),
    )
    return False


def _work(heartbeats: HeartbeatPublisher, worker: Worker, stop: Event) -> int:
    """Step until ``stop``; returns the exit code."""
    service = heartbeats.service
    thread = heartbeats.bus.clock.thread("heartbeat", partial(heartbeats.run, worker, stop))
    LOG.info("%s is up (instance %s)", service, heartbeats.bus.instance)
    heartbeats.progress.begin()
    try:
        while not stop.is_set():
            worker.step(STEP_S)
            heartbeats.progress.advance()
    except WorkerFailed as problem:
        LOG.error("%s: %s ends, to be started again", problem, service)
        return EXIT_CRASHED
    except Exception:
        LOG.exception("%s crashed", service)
        return EXIT_CRASHED
    finally:
        stop.set()
        thread.join(timeout=2 * HEARTBEAT_S)
        worker.close()
        LOG.info("%s is down", service)
    return EXIT_OK


@dataclass(slots=True)
class HeartbeatPublisher:
    """Publishes the heartbeat of a process."""

    service: str
    bus: Bus
    progress: LoopProgress

    def run(self, worker: Worker, stop: Event) -> None:
        """Publish health once a second and feed systemd's watchdog while the loop advances.

        The last heartbeat is sent when the process stops, so that its end follows a sign of life
        at once: what ends later than that was cut off.
        """
        publisher = self.bus.publish(heartbeat(self.service))
        clock, supervisor = self.bus.clock, Supervisor()
        seen, advanced_at = -1, clock.monotonic_s()
        while True:
            now, steps = clock.monotonic_s(), self.progress.steps or 0
            if steps != seen:
                seen, advanced_at = steps, now
            hung_s = now - advanced_at
            health = worker.health()
            if hung_s > HANG_S:
                health = Health(False, f"the main loop stands still for {hung_s:.0f} s")
                supervisor.hanging(health.problem)
            else:
                supervisor.alive(ready=health.ready, status=health.problem)
            publisher.put(_heartbeat(self.service, self.bus, steps, health))
            if _next_due(worker, health, stop, clock):
                supervisor.stopping()
                health = Health(False, "it is stopping")
                publisher.put(_heartbeat(self.service, self.bus, self.progress.steps or 0, health))
                return


def _next_due(worker: Worker, last: Health, stop: Event, clock: Clock) -> bool:
    """Wait a second, but no longer than until a worker that was not ready is; returns ``stop``."""
    due_s = clock.monotonic_s() + HEARTBEAT_S
    while not last.ready and clock.monotonic_s() < due_s and not stop.wait(READY_POLL_S):
        if worker.health().ready:
            return False
    return stop.wait(max(due_s - clock.monotonic_s(), 0.0))


def _heartbeat(service: str, bus: Bus, progress: int, health: Health) -> Heartbeat:
    return Heartbeat(
        service=service,
        instance=bus.instance,
        stamp_ns=bus.clock.wall_ns(),
        progress=progress,
        ready=health.ready,
        problem=health.problem,
        metrics={**bus.metrics(), **(health.metrics or {})},
        version=installed_version(),
    )


def watch_parent(stop: Event) -> None:
    """Set ``stop`` when the launcher named in the environment is gone, however it died."""
    parent = os.environ.get(PARENT_VARIABLE)

    def watch() -> None:
        while not stop.wait(HEARTBEAT_S):
            if parent != str(os.getppid()):
                LOG.warning("the launcher is gone, stopping")
                stop.set()

    if parent is not None:
        SystemClock().thread("watch-parent", watch)


def _stop_on_signals(life: ProcessLife) -> None:
    signals = itertools.count()

    def handle(signum: int, _frame: FrameType | None) -> None:
        if next(signals):  # the second signal: exit at once
            os._exit(128 + signum)
        if not life.built.is_set():  # what is half built, a kill may end at any time too
            os._exit(EXIT_OK)
        life.stop.set()

    for signum in (signal.SIGTERM, signal.SIGINT):
        signal.signal(signum, handle)
