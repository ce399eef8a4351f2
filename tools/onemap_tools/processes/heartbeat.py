"""Health of one service by its heartbeat, for the health checks of containers."""

from __future__ import annotations

import time
from pathlib import Path

from onemap_shared.config import BusConfig, read, section
from onemap_shared.keys import heartbeat
from onemap_shared.messages import Heartbeat
from onemap_shared.services import SERVICES
from onemap_shared.transport import Bus
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.session import temporary_session

CONNECT_S = 2.0
PATIENCE_S = 2.5  # two heartbeats


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
            f"No heartbeat of the {name} within {PATIENCE_S:g} s: start it with 'onemap {name}' if "
            "it does not run, restart it if its process hangs."
        )
    if beat.ready:
        return ""
    return f"The {name} is not ready: {beat.problem or 'it does not say why'}."
