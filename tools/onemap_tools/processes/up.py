"""Runs ``onemap up``: the services of one configuration on this machine until Ctrl-C."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console

from onemap_shared.config import BusConfig, read, section
from onemap_shared.runner import StartError
from onemap_shared.services import DRIVER, ROBOTS
from onemap_shared.transport import Bus
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.launch import Processes, ProcessSpec, onemap_command
from onemap_tools.processes.network import accepts_connections, is_local
from onemap_tools.processes.router import CANNOT_LISTEN
from onemap_tools.processes.services import CORE, check_robot
from onemap_tools.processes.session import connect

LAUNCHER = "up"  # name of a launcher on the bus
STARTABLE = ("router", *ROBOTS, *CORE)
WATCH_S = 0.2
TWO_ROBOTS = (
    "Two of simulator, replay and ros2 are configured: both robots, but a map follows one. Keep "
    "one of these sections of the configuration, or choose one with --only."
)
CONNECT_S = 0.5  # per attempt; processes and Ctrl-C are checked in between


def choose(
    only: Collection[str], sections: Mapping[str, Any], has_file: bool, router_here: bool
) -> tuple[str, ...]:
    """The names of the processes to start.

    Without ``only``: the router if ``router_here``; the robot that the configuration file has a
    section for (the simulator without a file); and ``CORE``. CliError for an unknown name and
    for two robots.
    """
    unknown = sorted(set(only) - set(STARTABLE))
    if unknown:
        raise CliError(
            f"There is no {unknown[0]!r} to start; there are {', '.join(STARTABLE)}.",
            EXIT_USAGE_ERROR,
        )
    if only:
        names = tuple(name for name in STARTABLE if name in only)
    else:
        robots = tuple(name for name in ROBOTS if name in sections) if has_file else ("simulator",)
        names = (*(("router",) if router_here else ()), *robots, *CORE)
    if len(set(names) & set(ROBOTS)) > 1:
        raise CliError(TWO_ROBOTS, EXIT_USAGE_ERROR)
    return names


def up(config: Path | None, only: Collection[str], log_folder: Path, console: Console) -> None:
    """Start the services, restart those that crash, stop all at Ctrl-C.

    CliError if a service cannot start as configured, or if one of them runs on the bus already.
    """
    sections = read(config)
    bus_config = section(sections, "bus", BusConfig)
    endpoints = bus_config.connect
    routed = any(accepts_connections(e) for e in endpoints if is_local(e))
    router_here = all(is_local(e) for e in endpoints) and not routed
    names = choose(only, sections, config is not None, router_here)
    if "router" in names and routed:
        raise CliError(
            f"A router answers at {', '.join(endpoints)} already: leave it out of --only."
        )
    for robot in set(names).intersection(ROBOTS):
        check_robot(robot, sections)
    arguments = ("--config", str(config)) if config is not None else ()
    specs = [
        ProcessSpec(name, onemap_command(name, *arguments), last=name == "router") for name in names
    ]
    with (
        Processes(specs, log_folder) as processes,
        interruptible(processes.kill) as stop,
    ):
        if "router" in names:  # without a router no launcher can conflict
            check_port(names, sections)
            processes.start("router")
        with joined(bus_config, names, processes, stop, console) as bus:
            if bus is None:
                return
            check_port(names, sections)
            processes.start()
            url = page_url(names, sections)
            page = f"Live page: {url}. " if url else ""
            console.print(
                f"Started {', '.join(names)}; logs in {processes.folder}. {page}Ctrl-C ends them."
            )
            while not stop.wait(WATCH_S):
                supervise(processes, time.monotonic(), console)
            console.print("Stopping ...")


@contextmanager
def joined(
    config: BusConfig,
    names: Collection[str],
    processes: Processes,
    stop: threading.Event,
    console: Console,
) -> Iterator[Bus | None]:
    """Wait for the router, and see that none of these services runs there.

    Yields the session, None if ``stop`` was set before. CliError if one runs: what another launcher
    starts at the same instant ends by itself, see ``runner``.
    """
    waits = False
    while (bus := connect(config, LAUNCHER, uuid.uuid4().hex[:12], CONNECT_S)) is None:
        if not waits and "router" not in names:
            console.print(f"Waiting for a router at {', '.join(config.connect)} ...")
        waits = True
        supervise(processes, time.monotonic(), console)
        if stop.is_set():
            yield None
            return
    try:
        if running := conflicts((service for service, _ in bus.processes()), names):
            where = ", ".join(config.connect)
            namespace = f", namespace {config.namespace}" if config.namespace else ""
            raise CliError(
                f"Nothing was started: already running at the router {where}{namespace}: "
                f"{', '.join(running)}. Stop that with Ctrl-C where it runs, start only what is "
                "missing with --only, or give this one another router (bus.connect) and page "
                "(gateway.port)."
            )
        yield bus
    finally:
        processes.stop()
        bus.close()


def conflicts(running: Iterable[str], names: Collection[str]) -> list[str]:
    """Services that run and would be started again, sorted; any two robots are one too many."""
    wanted = set(names)
    robots = {*ROBOTS, DRIVER} if wanted.intersection(ROBOTS) else set()
    return sorted(set(running) & (wanted | robots))


def check_port(names: Collection[str], sections: Mapping[str, Any]) -> None:
    """CliError if the gateway is to be started and its port is taken."""
    if "gateway" not in names:
        return
    from onemap_gateway.config import GatewayConfig
    from onemap_gateway.connections import listen

    gateway = section(sections, "gateway", GatewayConfig)
    try:
        listen(gateway.host, gateway.port).close()
    except StartError as problem:
        raise CliError(f"Nothing was started: the gateway {problem}.") from problem


def page_url(names: Collection[str], sections: Mapping[str, Any]) -> str:
    """Address of the live page as this machine reaches it; empty if no gateway is started."""
    if "gateway" not in names:
        return ""
    from onemap_gateway.config import GatewayConfig

    gateway = section(sections, "gateway", GatewayConfig)
    host = "127.0.0.1" if gateway.host in ("0.0.0.0", "::") else gateway.host
    return f"http://{host}:{gateway.port}" if gateway.port else ""


def supervise(processes: Processes, now_s: float, console: Console) -> None:
    """Report exits and restart processes; CliError if a restart cannot help.

    That is so at the first start only: for a configuration that is rejected, and for a router
    whose port another one has taken in between. What has run before is tried again: the port
    may become free, the file may be corrected.
    """
    for ended in processes.collect(now_s):
        if ended.first and ended.misconfigured:
            raise CliError(ended.report, EXIT_USAGE_ERROR)
        if ended.first and CANNOT_LISTEN in ended.tail:
            raise CliError(ended.report)
        console.print(f"{ended.report}\nIt is started again.", style="red")
    for name in processes.restart(now_s):
        console.print(f"Started {name} again.")
