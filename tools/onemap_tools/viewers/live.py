"""``onemap live``: a WebSocket server for Foxglove and Lichtblick, beside a running robot."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from onemap_shared.config import BusConfig, read, section
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.session import temporary_session
from onemap_tools.viewers.foxglove_server import FoxgloveServer
from onemap_tools.viewers.live_viewer import LiveViewer

CONNECT_S = 5.0
UPDATE_S = 0.03
HOST = "127.0.0.1"  # what the robot sees is for this machine; others come through a tunnel


@dataclass(frozen=True, slots=True)
class LiveOptions:
    """``port`` 0: any that is free. ``query``: empty: what a search looks for."""

    config: Path | None = None
    port: int = 8765
    query: str = ""


def live(options: LiveOptions, console: Console) -> None:
    """Serve until SIGINT or SIGTERM; CliError without a router or if the port is taken."""
    config = section(read(options.config), "bus", BusConfig)
    with interruptible() as stop, temporary_session(config, "viewer", CONNECT_S) as bus:
        server = listening(options)
        try:
            console.print(
                f"Foxglove or Lichtblick: open a connection to ws://{HOST}:{server.port}; layout: "
                "deploy/foxglove/onemap.json. Ctrl-C ends it.",
                soft_wrap=True,
            )
            viewer = LiveViewer(bus, server)
            while not stop.wait(UPDATE_S):
                viewer.update(time.monotonic(), time.time_ns())
        finally:
            server.close()


def listening(options: LiveOptions) -> FoxgloveServer:
    """A server on loopback; CliError if the port is taken."""
    try:
        return FoxgloveServer(HOST, options.port, options.query)
    except RuntimeError as problem:  # of the SDK, which has no class of its own for it
        raise CliError(
            f"Cannot listen on {HOST}:{options.port} ({problem}): choose another --port.",
            EXIT_USAGE_ERROR,
        ) from problem
