"""Sessions of commands on the bus, with a limit on the wait for a router."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig
from onemap_shared.transport import Bus
from onemap_tools.errors import CliError


@contextmanager
def temporary_session(config: BusConfig, name: str, patience_s: float) -> Iterator[Bus]:
    """A bus session that is closed at the end; CliError without a router within ``patience_s``."""
    bus = connect(config, name, uuid.uuid4().hex[:12], patience_s)
    if bus is None:
        raise CliError(
            f"No router at {', '.join(config.connect)}: start everything with 'onemap up', or the "
            "router alone with 'onemap router'; another address goes into bus.connect of --config."
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
    try:
        with _without_warnings(logging.getLogger("onemap.bus")):  # the caller reports it
            return open_bus(config, name, instance, gave_up)
    finally:
        timer.cancel()


@contextmanager
def _without_warnings(log: logging.Logger) -> Iterator[None]:
    """Only errors until the end; what is said afterwards is as loud as before."""

    def is_error(record: logging.LogRecord) -> bool:
        return record.levelno >= logging.ERROR

    log.addFilter(is_error)
    try:
        yield
    finally:
        log.removeFilter(is_error)
