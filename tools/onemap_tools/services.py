"""Which services there are, what configures them, and how one runs inside this process."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from onemap_shared.config import StrictModel, section
from onemap_shared.runner import StartError
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
        with installed(service):
            runpy.run_module(service.module, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else EXIT_MISUSED
    finally:
        sys.argv = before
    return 0


def section_model(name: str) -> type[StrictModel]:
    """What the section of this service must fit; Trouble if its packages are not installed."""
    service = SERVICES[name]
    with installed(service):
        config = import_module(f"{service.module}.config")
    model: type[StrictModel] = getattr(config, f"{name.capitalize()}Config")
    return model


def check_robot(name: str, sections: Mapping[str, Any]) -> None:
    """Trouble if this robot, simulator or replay, cannot start with what its section names."""
    config = section(sections, name, section_model(name))
    service = SERVICES[name]
    with installed(service):
        check = import_module(f"{service.module}.service").check
    try:
        check(config)
    except StartError as problem:
        raise Trouble(f"The {name} cannot start: {problem}.", EXIT_MISUSED) from problem


@contextmanager
def installed(service: Service) -> Iterator[None]:
    """Turns a package that is not here into Trouble that says what installs it."""
    try:
        yield
    except ModuleNotFoundError as missing:
        package = (missing.name or "").split(".")[0]
        if package.startswith("onemap_"):
            raise
        raise Trouble(
            f"The {service.name} needs the package {package!r}: "
            f"pip install 'onemap[{service.extra}]'",
            EXIT_MISUSED,
        ) from missing
