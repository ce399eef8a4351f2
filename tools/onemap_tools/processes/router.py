"""Runs the Zenoh router that all services connect to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from onemap_shared.bus import run_router
from onemap_shared.config import BusConfig, ConfigError, LogConfig, read, section
from onemap_shared.log import set_up_logging
from onemap_shared.runner import watch_parent
from onemap_shared.supervisor import Supervisor
from onemap_shared.tls_files import UnreadableFile, refuse_unreadable
from onemap_shared.watchdog import LoopProgress, watch
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.interrupts import interruptible

CANNOT_LISTEN = "The router cannot listen"


def run(config: Path | None, listen: Sequence[str], zenoh_config: Path | None) -> None:
    """Route until SIGINT or SIGTERM; ends the process if it no longer routes.

    Listens on ``listen``, else on the endpoints of ``zenoh_config``, else on those that the
    services of ``config`` connect to. If ``zenoh_config`` controls access, it does so below
    ``bus.namespace`` of ``config``.
    """
    sections = read(config)
    set_up_logging(section(sections, "log", LogConfig), "router")
    endpoints: tuple[str, ...] = ()
    if listen:
        endpoints = section({"bus": {"connect": list(listen)}}, "bus", BusConfig).connect
    elif zenoh_config is None:
        endpoints = section(sections, "bus", BusConfig).connect
    if zenoh_config is not None and not zenoh_config.is_file():
        raise ConfigError(f"cannot read the router's configuration {zenoh_config}: no such file")
    with interruptible() as stop:
        watch_parent(stop)
        progress, supervisor = LoopProgress(), Supervisor()
        progress.begin()
        watched = watch("router", progress, stop)

        def routed() -> None:
            """Tell the watchdogs, ours and systemd's."""
            progress.advance()
            supervisor.alive(ready=True)

        try:
            text = zenoh_config.read_text(encoding="utf-8") if zenoh_config else ""
            refuse_unreadable(endpoints, text)
            namespace = section(sections, "bus", BusConfig).namespace
            run_router(endpoints, stop, zenoh_config, routed, namespace=namespace)
        except ConfigError:
            raise
        except UnreadableFile as problem:
            raise CliError(f"{CANNOT_LISTEN}: {problem}.", EXIT_USAGE_ERROR) from problem
        except Exception as problem:  # zenoh's exception type is confined to bus.py
            reason = str(problem).split(" at /")[0]
            where = ", ".join(endpoints) or str(zenoh_config)
            raise CliError(
                f"{CANNOT_LISTEN} on {where}: {reason}. Is another one running there?"
            ) from problem
        finally:
            watched.set()
