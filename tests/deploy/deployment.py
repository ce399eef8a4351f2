"""The files of ``deploy/`` and what the services read, for the tests beside this one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml
from pydantic import BaseModel

from onemap_tools.cli.config_report import installed_models
from onemap_tools.processes.services import CORE
from tests.structure import ROOT

DEPLOY = ROOT / "deploy"
CONFIGURATIONS = sorted((DEPLOY / "config").glob("*.yaml"))
ROLES = ("simulator", *CORE)


def models() -> Mapping[str, type[BaseModel]]:
    """The pydantic model of every section of a configuration file."""
    models = installed_models()
    assert models.missing == {}
    return models.known


def compose(file: str = "compose.yaml") -> dict[str, Any]:
    """The services of a compose file, YAML merge keys resolved."""
    document = yaml.safe_load((DEPLOY / file).read_text(encoding="utf-8"))
    services: dict[str, Any] = document["services"]
    return services
