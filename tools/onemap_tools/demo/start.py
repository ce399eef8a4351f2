"""Starts a demo: its processes first, then what searches with them, which is imported meanwhile."""

from __future__ import annotations

import time
from typing import Any

import psutil
from rich.console import Console

from onemap_shared.config import ConfigError
from onemap_tools.demo.setup import DemoOptions, set_up
from onemap_tools.errors import CliError, to_cli_error
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.launch import Processes


def run(options: DemoOptions, console: Console) -> dict[str, Any]:
    """Run the demo; returns the summary as JSON can hold it.

    Unless it is headless, it keeps running with the live page until Ctrl-C. A CliError holds the
    summary of the failed run as its document.
    """
    try:
        return _run(options, console)
    except (CliError, ConfigError) as cause:
        error = to_cli_error(cause)
        failed = {
            "worked": False,
            "seed": options.seed,
            "objects": [],
            "trouble": str(error),
            "folder": str(options.folder),
        }
        raise CliError(str(error), error.exit_code, failed) from cause


def _run(options: DemoOptions, console: Console) -> dict[str, Any]:
    # With the imports of this process, which whoever types the command waits for as well.
    began_s = time.monotonic() - (time.time() - psutil.Process().create_time())
    setup = set_up(options)
    for warning in setup.warnings:
        console.print(f"Warning: {warning}", style="yellow", soft_wrap=True)
    with (
        Processes(setup.specs, options.folder / "logs", setup.environment) as processes,
        interruptible(processes.kill) as stop,
    ):
        console.print(f"Starting {len(setup.specs)} processes; logs in {processes.folder}")
        processes.start()
        from onemap_tools.demo.run import DemoRun

        demo = DemoRun(options, setup, processes, stop, began_s)
        document = demo.run(console)
        if not options.headless:
            demo.stay_up(console)
    return document
