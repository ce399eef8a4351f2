"""Runs a service inside this process and finds the model of its configuration."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from onemap_shared.config import section
from onemap_shared.params import Params
from onemap_shared.runner import StartError
from onemap_shared.services import SERVICES, STAGES, Service
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

CORE = (*STAGES, "gateway")  # what every robot needs


def run(name: str, arguments: Sequence[str]) -> int:
    """Run a service in this process until it is stopped; returns its exit code."""
    service = SERVICES[name]
    before = sys.argv
    sys.argv = [f"onemap {name}", *arguments]
    try:
        with installed(service):
            runpy.run_module(service.module, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else EXIT_USAGE_ERROR
    finally:
        sys.argv = before
    return 0


def section_model(name: str) -> type[Params]:
    """The model of the service's section; CliError if its packages are not installed."""
    service = SERVICES[name]
    with installed(service):
        config = import_module(f"{service.module}.config")
    model: type[Params] = getattr(config, f"{name.capitalize()}Config")
    return model


def check_robot(name: str, sections: Mapping[str, Any]) -> None:
    """CliError if this robot, simulator or replay, cannot start with its configuration."""
    config = section(sections, name, section_model(name))
    service = SERVICES[name]
    with installed(service):
        check = import_module(f"{service.module}.service").check
    try:
        check(config)
    except StartError as problem:
        raise CliError(f"The {name} cannot start: {problem}.", EXIT_USAGE_ERROR) from problem


@contextmanager
def installed(service: Service) -> Iterator[None]:
    """Turn a missing package into a CliError that says how to install it."""
    try:
        yield
    except ModuleNotFoundError as missing:
        package = (missing.name or "").split(".")[0]
        if package.startswith("onemap_"):
            raise
        raise CliError(
            f"The {service.name} needs the package {package!r}: "
            f"pip install 'onemap[{service.extra}]'",
            EXIT_USAGE_ERROR,
        ) from missing
