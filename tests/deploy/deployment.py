"""The files of ``deploy/`` and what the services read, for the tests beside this one."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from onemap_shared.config import BusConfig, LogConfig

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
CONFIGURATIONS = sorted((DEPLOY / "config").glob("*.yaml"))
ROLES = ("simulator", "perception", "mapper", "planner", "gateway")
MODELS = {
    "perception": ("onemap_perception.config", "PerceptionConfig"),
    "mapper": ("onemap_mapper.config", "MapperConfig"),
    "planner": ("onemap_planner.config", "PlannerConfig"),
    "gateway": ("onemap_gateway.config", "GatewayConfig"),
    "simulator": ("onemap_simulator.config", "SimulatorConfig"),
    "replay": ("onemap_simulator.replay.config", "ReplayConfig"),
}


def models() -> dict[str, type[BaseModel]]:
    """The pydantic model of every section of a configuration file."""
    found: dict[str, type[BaseModel]] = {"bus": BusConfig, "log": LogConfig}
    for section, (module, name) in MODELS.items():
        found[section] = getattr(import_module(module), name)
    return found


def compose(file: str = "compose.yaml") -> dict[str, Any]:
    """The services of a compose file, YAML merge keys resolved."""
    document = yaml.safe_load((DEPLOY / file).read_text(encoding="utf-8"))
    services: dict[str, Any] = document["services"]
    return services
