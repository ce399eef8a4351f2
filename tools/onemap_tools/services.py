"""Which services there are, and how one runs inside this process."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from onemap_tools.trouble import EXIT_MISUSED, Trouble


@dataclass(frozen=True, slots=True)
class Service:
    """A service: the module that runs it and the extra that installs what it needs."""

    name: str
    module: str
    extra: str
    summary: str


SERVICES = {
    service.name: service
    for service in (
        Service("simulator", "onemap_simulator", "simulator", "a robot in a made-up apartment"),
        Service(
            "replay", "onemap_simulator.replay", "simulator", "a recording in place of a robot"
        ),
        Service("perception", "onemap_perception", "perception", "images to features"),
        Service("mapper", "onemap_mapper", "mapper", "features to a map that answers text"),
        Service("planner", "onemap_planner", "planner", "where to look next, and driving there"),
        Service("gateway", "onemap_gateway", "gateway", "the HTTP API and the live page"),
    )
}


def run(name: str, arguments: Sequence[str]) -> int:
    """Run a service in this process until it is stopped; returns its exit code."""
    service = SERVICES[name]
    before = sys.argv
    sys.argv = [f"onemap {name}", *arguments]
    try:
        runpy.run_module(service.module, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else EXIT_MISUSED
    except ModuleNotFoundError as missing:
        package = (missing.name or "").split(".")[0]
        if package.startswith("onemap_"):
            raise
        raise Trouble(
            f"The {name} needs the package {package!r}: pip install 'onemap[{service.extra}]'",
            EXIT_MISUSED,
        ) from missing
    finally:
        sys.argv = before
    return 0
