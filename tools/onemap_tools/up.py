"""``onemap up``: services of one configuration on this machine until Ctrl-C."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from onemap_shared.config import BusConfig, read, section
from onemap_tools.interrupts import interruptible
from onemap_tools.launch import Ended, Processes, ProcessSpec, command_of
from onemap_tools.network import answers, is_local
from onemap_tools.trouble import EXIT_MISUSED, Trouble

ALWAYS = ("perception", "mapper", "planner", "gateway")
ROBOTS = ("simulator", "replay")
STARTABLE = ("router", *ROBOTS, *ALWAYS)
WATCH_S = 0.2


def choose(
    only: Collection[str], sections: Mapping[str, Any], has_file: bool, router_here: bool
) -> tuple[str, ...]:
    """What to start.

    Without ``only``: a router if none answers and one is wanted on this machine; the robot
    that the configuration file has a section for (the simulator if there is no file); and
    all other services.
    """
    unknown = sorted(set(only) - set(STARTABLE))
    if unknown:
        raise Trouble(
            f"There is no {unknown[0]!r} to start; there are {', '.join(STARTABLE)}.", EXIT_MISUSED
        )
    if only:
        return tuple(name for name in STARTABLE if name in only)
    robots = tuple(name for name in ROBOTS if name in sections) if has_file else ("simulator",)
    router = ("router",) if router_here else ()
    return (*router, *robots, *ALWAYS)


def up(config: Path | None, only: Collection[str], log_folder: Path, console: Console) -> None:
    """Start them, restart what crashes, stop all at Ctrl-C; Trouble if one refuses to start."""
    sections = read(config)
    endpoints = section(sections, "bus", BusConfig).connect
    router_here = all(is_local(e) for e in endpoints) and not any(answers(e) for e in endpoints)
    names = choose(only, sections, config is not None, router_here)
    arguments = ("--config", str(config)) if config is not None else ()
    specs = [
        ProcessSpec(name, command_of(name, *arguments), last=name == "router") for name in names
    ]
    with (
        Processes(specs, log_folder) as processes,
        interruptible(processes.kill) as stop,
    ):
        processes.start()
        console.print(f"Started {', '.join(names)}; logs in {log_folder}. Ctrl-C ends them.")
        while not stop.wait(WATCH_S):
            supervise(processes, time.monotonic(), console)
        console.print("Stopping ...")


def supervise(processes: Processes, now_s: float, console: Console) -> None:
    """Tell what ended, start again what is due; Trouble if a restart could not help."""
    for ended in processes.collect(now_s):
        if ended.misused:
            raise Trouble(told(ended), EXIT_MISUSED)
        console.print(told(ended), style="red", markup=False)
    for name in processes.restart(now_s):
        console.print(f"Started {name} again.")


def told(ended: Ended) -> str:
    """What happened to a process, with the end of its log."""
    return f"{ended.sentence}. Its last lines:\n{ended.tail}"
