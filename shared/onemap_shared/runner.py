"""Runs a service process: configuration, logging, bus, heartbeat, signals, systemd.

Calls the worker's ``step`` in a loop and publishes its health once a second. When any thread
dies, or the loop hangs, the process ends: the supervisor's restart is the recovery.
"""
# Talks: the process around a worker.

from __future__ import annotations

import argparse
import faulthandler
import gc
import itertools
import logging
import os
import random
import signal
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TypeVar

from pydantic import BaseModel

from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.compression import CompressionError
from onemap_shared.config import BusConfig, ConfigError, load
from onemap_shared.keys import heartbeat
from onemap_shared.log import set_up_logging
from onemap_shared.messages import Heartbeat
from onemap_shared.services import SOLE, installed_version, role_of
from onemap_shared.supervisor import Supervisor
from onemap_shared.tls_files import UnreadableFile
from onemap_shared.transport import Bus, Health, Worker
from onemap_shared.watchdog import LoopProgress, watch

C = TypeVar("C", bound=BaseModel)
LOG = logging.getLogger("onemap.runner")

STEP_S = 0.1  # longest wait inside a step, and so the delay to notice a signal
HEARTBEAT_S = 1.0
NOTICE_S = 0.1  # until it is told that a worker is ready now: a start waits for each of them
PARENT_VARIABLE = "ONEMAP_PARENT_PID"  # set by a launcher to its own process id
HANG_S = 10.0  # a loop without progress for this long hangs: stop feeding systemd's watchdog
CLAIM_S = 4.0  # the process before is gone by then: a dead link is noticed after 2 s
CLAIM_RETRY_S = (0.2, 0.6)  # drawn, so that two at the same time do not meet again
EXIT_OK, EXIT_CRASHED, EXIT_MISUSED = 0, 1, 2


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


def run_service(
    service: str,
    model: type[C],
    build: Callable[[Bus, C], Worker],
    arguments: list[str] | None = None,
    *,
    check: Callable[[C], None] = lambda _: None,
    section: str = "",
) -> int:
    """Run a service until SIGTERM or SIGINT; returns the exit code.

    0 after a signal, 1 after a crash or when it cannot start now, 2 when it cannot start as
    configured. ``check`` looks at what the configuration names, such as files, before the router
    is waited for; it and ``build`` may raise StartError. ``section``: of the configuration, where
    it is not called as the service is.
    """
    gc.freeze()  # what was imported stays: garbage is looked for among the rest only
    gc.enable()
    parser = argparse.ArgumentParser(prog=f"onemap {service}")
    parser.add_argument("--config", type=Path, help="YAML file; defaults apply without it")
    options = parser.parse_args(arguments)
    try:
        bus_config, log_config, config = load(options.config, section or service, model)
    except ConfigError as problem:
        print(f"{service}: {problem}", file=sys.stderr)
        return EXIT_MISUSED
    set_up_logging(log_config, service)
    faulthandler.enable()  # systemd's watchdog sends SIGABRT: say where each thread stands
    sys.setswitchinterval(SWITCH_S)
    try:
        check(config)
    except StartError as problem:
        return _refuse_start(problem)
    stop = threading.Event()
    _stop_on_signals(stop)
    watch_parent(stop)
    return _join_and_work(service, bus_config, lambda bus: build(bus, config), stop)


def _join_and_work(
    service: str, config: BusConfig, build: Callable[[Bus], Worker], stop: threading.Event
) -> int:
    """Run the service on the bus until ``stop``; returns the exit code."""
    crashed = _stop_on_dead_threads(stop)
    progress = LoopProgress()
    watch(service, progress, stop)  # to the end of the process: what follows may hang too
    instance = uuid.uuid4().hex[:12]
    try:
        supervisor = Supervisor()

        def waiting(what: str) -> None:  # the process works; the router may come hours later
            supervisor.alive(ready=False, status=what)

        bus = open_bus(config, service, instance, stop, announce=False, waiting=waiting)
    except UnreadableFile as problem:
        return _refuse_start(StartError(str(problem)))
    if bus is None:
        return EXIT_OK
    heartbeats = HeartbeatPublisher(service, bus, progress)
    try:
        if not _joined_alone(bus, stop):
            return EXIT_OK if stop.is_set() else EXIT_CRASHED
        code = _work(heartbeats, lambda: build(bus), stop)
    finally:
        bus.close()
    return EXIT_CRASHED if crashed.is_set() else code


def _joined_alone(bus: ZenohBus, stop: threading.Event) -> bool:
    """Announce the service; False if another process has its role for ``CLAIM_S``, or on stop.

    Exit code 1 then, not 2: a supervisor that tries again takes over when the other ends.
    """
    if role_of(bus.service) not in SOLE:
        bus.announce()
        return True
    deadline = time.monotonic() + CLAIM_S
    others: tuple[str, ...] = ()
    while time.monotonic() < deadline:
        try:
            others = bus.claim()
        except ConnectionError:  # nobody can be asked: wait for the router, and then as long again
            deadline = time.monotonic() + CLAIM_S
        else:
            if not others:
                return True
        if stop.wait(random.uniform(*CLAIM_RETRY_S)):
            return False
    LOG.error(
        "the %s is not started: %s runs on these keys; stop it first, or give this robot a "
        "bus.namespace of its own",
        bus.service,
        ", ".join(others),
    )
    return False


def _work(
    heartbeats: HeartbeatPublisher, build: Callable[[], Worker], stop: threading.Event
) -> int:
    service = heartbeats.service
    try:
        worker = build()
    except StartError as problem:
        return _refuse_start(problem)
    except CompressionError as problem:  # of bus.link, by the first topic that needs it
        return _refuse_start(StartError(f"what it sends {problem}"))
    thread = threading.Thread(
        target=heartbeats.run, args=(worker, stop), name="heartbeat", daemon=True
    )
    thread.start()
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


def _refuse_start(problem: StartError) -> int:
    """Log why the service cannot start; returns 1 if a later start may succeed, else 2."""
    LOG.error("%s", problem)
    return EXIT_CRASHED if problem.temporary else EXIT_MISUSED


@dataclass(slots=True)
class HeartbeatPublisher:
    """Publishes the heartbeat of a process."""

    service: str
    bus: Bus
    progress: LoopProgress

    def run(self, worker: Worker, stop: threading.Event) -> None:
        """Publish health once a second and feed systemd's watchdog while the loop advances.

        The last heartbeat is sent when the process stops, so that its end follows a sign of life
        at once: what ends later than that was cut off.
        """
        publisher = self.bus.publish(heartbeat(self.service))
        supervisor = Supervisor()
        seen, advanced_at = -1, time.monotonic()
        while True:
            now, steps = time.monotonic(), self.progress.steps or 0
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
            if _next_due(worker, health, stop):
                supervisor.stopping()
                health = Health(False, "it is stopping")
                publisher.put(_heartbeat(self.service, self.bus, self.progress.steps or 0, health))
                return


def _next_due(worker: Worker, told: Health, stop: threading.Event) -> bool:
    """Wait a second, but no longer than until a worker that was not ready is; returns ``stop``."""
    due_s = time.monotonic() + HEARTBEAT_S
    while not told.ready and time.monotonic() < due_s and not stop.wait(NOTICE_S):
        if worker.health().ready:
            return False
    return stop.wait(max(due_s - time.monotonic(), 0.0))


def _heartbeat(service: str, bus: Bus, progress: int, health: Health) -> Heartbeat:
    return Heartbeat(
        service=service,
        instance=bus.instance,
        stamp_ns=time.time_ns(),
        progress=progress,
        ready=health.ready,
        problem=health.problem,
        metrics={**bus.metrics(), **(health.metrics or {})},
        version=installed_version(),
    )


def watch_parent(stop: threading.Event) -> None:
    """Set ``stop`` when the launcher named in the environment is gone, however it died."""
    parent = os.environ.get(PARENT_VARIABLE)

    def watch() -> None:
        while not stop.wait(HEARTBEAT_S):
            if parent != str(os.getppid()):
                LOG.warning("the launcher is gone, stopping")
                stop.set()

    if parent is not None:
        threading.Thread(target=watch, name="watch-parent", daemon=True).start()


def _stop_on_signals(stop: threading.Event) -> None:
    def handle(signum: int, _frame: FrameType | None) -> None:
        if stop.is_set():  # the second signal: exit at once
            os._exit(128 + signum)
        stop.set()

    for signum in (signal.SIGTERM, signal.SIGINT):
        signal.signal(signum, handle)


def _stop_on_dead_threads(stop: threading.Event) -> threading.Event:
    """A background thread that dies takes the process down; returns the event that says so."""
    crashed = threading.Event()

    def handle(problem: threading.ExceptHookArgs) -> None:
        name = problem.thread.name if problem.thread else "a thread"
        info = (problem.exc_type, problem.exc_value, problem.exc_traceback)
        LOG.critical("%s died", name, exc_info=info)  # type: ignore[arg-type]
        crashed.set()
        stop.set()

    threading.excepthook = handle
    return crashed


START_S = "start_s"  # metric: seconds that the start has taken so far; absent once it is over


@contextmanager
def long_start(bus: Bus, service: str, what: str, usual_s: float) -> Iterator[None]:
    """Publish once a second until the block ends that the service is not ready, and why.

    what: a sentence; the heartbeats add how much of the usual time has passed. Their progress
    counts them: the main loop has not begun yet.
    systemd is asked for more time, so that it does not end what advances.
    """
    done = threading.Event()
    publisher = bus.publish(heartbeat(service))
    supervisor = Supervisor()
    began_s = time.monotonic()

    def beat(count: int) -> None:
        passed_s = time.monotonic() - began_s
        supervisor.starting(what)
        problem = f"{what}: {passed_s:.0f} of about {usual_s:.0f} s"
        publisher.put(_heartbeat(service, bus, count, Health(False, problem, {START_S: passed_s})))

    def run() -> None:
        for count in itertools.count(2):
            if done.wait(HEARTBEAT_S):
                return
            beat(count)

    beat(1)
    thread = threading.Thread(target=run, name="long-start", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def is_starting(beat: Heartbeat) -> bool:
    """Whether a heartbeat says that the service's start goes on."""
    return START_S in beat.metrics
