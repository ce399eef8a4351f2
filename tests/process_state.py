"""What a test may leave behind in its process, and so change for those after it."""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

PREFIX = "ONEMAP"  # of the variables that configure services, and that tell of a launcher
LOGGERS = "onemap"
SIGNALS = (signal.SIGINT, signal.SIGTERM)
UNTOUCHED = (logging.NOTSET, False, True, (), ())


@dataclass(frozen=True, slots=True)
class ProcessState:
    """The state of a process that tests share.

    loggers: level, whether it is disabled, whether it propagates, handlers and filters of those of
    ours that differ from a new one.
    """

    loggers: Mapping[str, tuple[Any, ...]]
    environment: Mapping[str, str]
    folder: str
    signals: Mapping[signal.Signals, Any]
    thread_hook: Any

    @classmethod
    def now(cls) -> ProcessState:
        """The state of this process."""
        settings = {logger.name: _settings(logger) for logger in _loggers()}
        return cls(
            loggers={name: each for name, each in settings.items() if each != UNTOUCHED},
            environment={k: v for k, v in os.environ.items() if k.startswith(PREFIX)},
            folder=os.getcwd(),
            signals={signum: signal.getsignal(signum) for signum in SIGNALS},
            thread_hook=threading.excepthook,
        )

    def restore(self) -> list[str]:
        """Make the process as it was; the names of what was not."""
        now = ProcessState.now()
        changed = [f.name for f in fields(self) if getattr(self, f.name) != getattr(now, f.name)]
        if not changed:
            return []
        for logger in _loggers():
            settings = self.loggers.get(logger.name, UNTOUCHED)
            level, logger.disabled, logger.propagate, handlers, filters = settings
            logger.setLevel(level)
            logger.handlers, logger.filters = [*handlers], [*filters]
        for name in set(now.environment) - set(self.environment):
            del os.environ[name]
        os.environ.update(self.environment)
        os.chdir(self.folder)
        for signum, handler in self.signals.items():
            signal.signal(signum, handler)
        threading.excepthook = self.thread_hook
        return changed


def _loggers() -> list[logging.Logger]:
    """Our loggers that exist."""
    known = logging.root.manager.loggerDict.items()
    return [
        logger
        for name, logger in list(known)
        if name.split(".")[0] == LOGGERS and isinstance(logger, logging.Logger)
    ]


def _settings(logger: logging.Logger) -> tuple[Any, ...]:
    return (
        logger.level,
        logger.disabled,
        logger.propagate,
        tuple(logger.handlers),
        tuple(logger.filters),
    )
