"""What a process tells its supervisor: systemd, or the health check of its container.

systemd hears READY, WATCHDOG and STATUS. A container's health check looks how old a file is, so
that it costs no process of Python: the file named by ``ONEMAP_READY_FILE`` is touched instead.
"""
# Talks: the supervisor's socket and its variables.
# Touches files: the ready file.

from __future__ import annotations

import logging
import os
from pathlib import Path

import sdnotify

SUPERVISOR_VARIABLE = "ONEMAP_SUPERVISOR"  # systemd or compose; a shell without it
LAUNCHED_VARIABLE = "ONEMAP_LAUNCHED"  # services that the launcher of this process starts again
READY_FILE_VARIABLE = "ONEMAP_READY_FILE"
JOURNAL_VARIABLE = "JOURNAL_STREAM"  # set by systemd where the output goes to its journal
MORE_TIME_US = 30_000_000  # asked of systemd each second of a start, beyond TimeoutStartSec
START_COMMANDS = {
    "systemd": "systemctl start onemap-{service}",
    "compose": "docker compose -p onemap start {service}",
}
PRIORITIES = ((logging.CRITICAL, 2), (logging.ERROR, 3), (logging.WARNING, 4), (logging.INFO, 6))


def launched() -> frozenset[str]:
    """The services that the launcher of this process starts, and starts again; empty without it."""
    return frozenset(os.environ.get(LAUNCHED_VARIABLE, "").split())


def start_hint(service: str) -> str:
    """What to do about a service that does not run, in words that fit where this process runs."""
    if service in launched():
        return "it is started again by itself, and its log says why it ended"
    supervisor = os.environ.get(SUPERVISOR_VARIABLE, "")
    if command := START_COMMANDS.get(supervisor, ""):
        return f"start it with '{command.format(service=service)}', or see 'onemap status'"
    return f"start it with 'onemap service {service}' and the same --config, or see 'onemap status'"


class Supervisor:
    """The supervisor of this process, if it has one; every call without one does nothing."""

    def __init__(self) -> None:
        self._systemd = sdnotify.SystemdNotifier()
        path = os.environ.get(READY_FILE_VARIABLE)
        self._ready_file = Path(path) if path else None

    def starting(self, what: str, *, longer: bool = False) -> None:
        """Say, once a second, that the start goes on; longer: beyond TimeoutStartSec if need be."""
        more = f"EXTEND_TIMEOUT_USEC={MORE_TIME_US}\n" if longer else ""
        self._systemd.notify(f"{more}WATCHDOG=1\nSTATUS={what}")

    def alive(self, *, ready: bool, status: str = "") -> None:
        """Say, once a second, that the main loop goes on; ready: whether it does its work."""
        self._systemd.notify(f"READY=1\nWATCHDOG=1\nSTATUS={status or 'working'}")
        if ready and self._ready_file is not None:
            self._ready_file.touch()

    def hanging(self, status: str) -> None:
        """Say what is wrong, without feeding the watchdog."""
        self._systemd.notify(f"STATUS={status}")

    def stopping(self) -> None:
        """Say that the process ends as it was told to."""
        self._systemd.notify("STOPPING=1")


class JournalFormatter(logging.Formatter):
    """Another formatter's lines with the priority that the journal reads, as ``<3>``."""

    def __init__(self, formatter: logging.Formatter) -> None:
        super().__init__()
        self._formatter = formatter

    def format(self, record: logging.LogRecord) -> str:
        """The record with its priority before each line."""
        priority = next((number for level, number in PRIORITIES if record.levelno >= level), 7)
        lines = self._formatter.format(record).splitlines()
        return "\n".join(f"<{priority}>{line}" for line in lines)


def with_priorities(formatter: logging.Formatter) -> logging.Formatter:
    """The formatter for this process's log: with priorities where the journal reads them."""
    return JournalFormatter(formatter) if os.environ.get(JOURNAL_VARIABLE) else formatter
