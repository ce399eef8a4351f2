"""Sessions of commands on the bus, and what one service says of itself there."""

from __future__ import annotations

import logging
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig, read, section
from onemap_shared.keys import heartbeat
from onemap_shared.messages import Heartbeat
from onemap_shared.services import SERVICES
from onemap_shared.transport import Bus
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.gateway import start_all

CONNECT_S = 2.0  # of a health check
PATIENCE_S = 2.5  # two heartbeats


@contextmanager
def temporary_session(config: BusConfig, name: str, patience_s: float) -> Iterator[Bus]:
    """A bus session that is closed at the end; CliError without a router within ``patience_s``."""
    bus = connect(config, name, uuid.uuid4().hex[:12], patience_s)
    if bus is None:
        raise CliError(
            f"No router at {', '.join(config.connect)}: start everything with {start_all()}, or "
            "the router alone with 'onemap service router'; another address goes into bus.connect "
            "of --config."
        )
    try:
        yield bus
    finally:
        bus.close()


def connect(config: BusConfig, name: str, instance: str, patience_s: float) -> ZenohBus | None:
    """A bus session under this name; None without a router within ``patience_s``."""
    gave_up = threading.Event()
    timer = threading.Timer(patience_s, gave_up.set)
    timer.start()
    log = logging.getLogger("onemap.bus")
    log.addFilter(_is_error)  # the caller reports the rest
    try:
        return open_bus(config, name, instance, gave_up)
    finally:
        log.removeFilter(_is_error)
        timer.cancel()


def _is_error(record: logging.LogRecord) -> bool:
    return record.levelno >= logging.ERROR


def check_service(name: str, config: Path | None) -> None:
    """Return if the service reports that it is ready; CliError with the reason otherwise."""
    if name not in SERVICES:
        raise CliError(
            f"There is no service {name!r}; there are {', '.join(SERVICES)}.", EXIT_USAGE_ERROR
        )
    with temporary_session(section(read(config), "bus", BusConfig), "status", CONNECT_S) as bus:
        problem = problem_of(name, next_heartbeat(bus, name, PATIENCE_S))
    if problem:
        raise CliError(problem)


def next_heartbeat(bus: Bus, name: str, patience_s: float) -> Heartbeat | None:
    """The first ready heartbeat within ``patience_s``, else the last one; None without any."""
    beats = bus.subscribe(heartbeat(name), 4)
    deadline_s, last = time.monotonic() + patience_s, None
    while (left_s := deadline_s - time.monotonic()) > 0:
        beat = beats.take(left_s)
        last = beat or last
        if last is not None and last.ready:
            return last
    return last


def problem_of(name: str, beat: Heartbeat | None) -> str:
    """Why the service is not ready, in a sentence; empty if it is."""
    if beat is None:
        return (
            f"No heartbeat of the {name} within {PATIENCE_S:g} s: start it with 'onemap service "
            f"{name}' and the same --config if it does not run, restart it if its process hangs."
        )
    if beat.ready:
        return ""
    return f"The {name} is not ready: {beat.problem or 'it does not say why'}."
