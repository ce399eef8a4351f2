"""Runs a service inside this process and finds the model of its configuration."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from onemap_shared.config import section
from onemap_shared.params import Params
from onemap_shared.runner import StartError
from onemap_shared.services import SERVICES, STAGES
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

CORE = (*STAGES, "gateway")  # what every robot needs


def run(name: str, config: Path | None) -> None:
    """Run a service in this process, which ends with it; CliError if a package is missing."""
    service = SERVICES[name]
    sys.argv = [f"onemap {name}", *(("--config", str(config)) if config is not None else ())]
    with requires_extra(service.extra, f"The {service.name}"):
        runpy.run_module(service.module, run_name="__main__", alter_sys=True)


def section_model(name: str) -> type[Params]:
    """The model of the service's section; CliError if its packages are not installed."""
    service = SERVICES[name]
    with requires_extra(service.extra, f"The {service.name}"):
        config = import_module(f"{service.module}.config")
    model: type[Params] = getattr(config, f"{name.capitalize()}Config")
    return model


def check_robot(name: str, sections: Mapping[str, Any]) -> None:
    """CliError if this robot cannot start with its configuration, as far as that can be known."""
    config = section(sections, name, section_model(name))
    service = SERVICES[name]
    with requires_extra(service.extra, f"The {service.name}"):
        module = import_module(f"{service.module}.service")
    if not hasattr(module, "check"):  # only a start can show
        return
    try:
        module.check(config)
    except StartError as problem:
        raise CliError(f"The {name} cannot start: {problem}.", EXIT_USAGE_ERROR) from problem
