"""What install.sh asks of a service, run as its user: ``python check_service.py NAME [VERSION]``.

Without a version, before the switch: the service can be imported, and ONEMAP_CONFIG names a valid
file. With one, after it: the service says on the bus that it runs this version. Exit code 0 if so,
else a sentence; ``NOBODY_THERE`` where no router answers that could be asked.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path

from onemap_shared.config import BusConfig, ConfigError, read, section
from onemap_shared.services import SERVICES
from onemap_tools.cli import config_report
from onemap_tools.errors import CliError
from onemap_tools.processes.session import connect, next_heartbeat

PATIENCE_S = 5.0  # two heartbeats, on a machine that starts everything at once
NOBODY_THERE = 3


def check(name: str, config: Path) -> None:
    """Import the service and check its configuration; SystemExit with the reason if one fails."""
    module = "onemap_tools.processes.router"
    if name != "router":  # not its __main__, which would run it
        module = f"{SERVICES[name].module}.service"
    try:
        import_module(module)
    except (Exception, SystemExit) as problem:
        reason = f"{type(problem).__name__}: {problem}"
        raise SystemExit(f"the {name} cannot be imported: {reason}") from problem
    try:
        config_report.check(config, config_report.installed_models())
    except (CliError, ConfigError) as problem:
        raise SystemExit(f"{config}: {problem}") from problem


def ask(name: str, config: Path, version: str) -> None:
    """Hear the service's heartbeat; SystemExit with the reason if it does not say ``version``."""
    bus = connect(section(read(config), "bus", BusConfig), "status", "install", PATIENCE_S)
    if bus is None:
        raise SystemExit(NOBODY_THERE)
    try:
        beat = None if name == "router" else next_heartbeat(bus, name, PATIENCE_S)
    finally:
        bus.close()
    if name == "router":
        return
    if beat is None:
        raise SystemExit(f"the {name} does not say that it runs")
    if beat.version != version:
        raise SystemExit(f"the {name} runs version {beat.version}, not {version}")


if __name__ == "__main__":
    service, *wanted = sys.argv[1:]
    file = Path(os.environ["ONEMAP_CONFIG"])
    if wanted:
        ask(service, file, *wanted)
    else:
        check(service, file)
