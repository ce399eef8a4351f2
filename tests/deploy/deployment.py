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


class Override(list[Any]):
    """A list that replaces that of the file before (``!override``)."""


class _ComposeLoader(yaml.SafeLoader):
    """YAML with the tag of compose."""


def _override(loader: yaml.SafeLoader, node: yaml.SequenceNode) -> Override:
    return Override(loader.construct_sequence(node))


_ComposeLoader.add_constructor("!override", _override)


def compose_document(file: str = "compose.yaml") -> dict[str, Any]:
    """A compose file, YAML merge keys resolved."""
    text = (DEPLOY / file).read_text(encoding="utf-8")
    document: dict[str, Any] = yaml.load(text, _ComposeLoader)
    return document


def compose(file: str = "compose.yaml") -> dict[str, Any]:
    """The services of a compose file."""
    services: dict[str, Any] = compose_document(file)["services"]
    return services


def mounts(service: dict[str, Any]) -> dict[str, str]:
    """Container path to host path or volume name."""
    parts = [volume.split(":") for volume in service.get("volumes", [])]
    return {target: source for source, target, *_ in parts}


def with_file(service: dict[str, Any], added: dict[str, Any]) -> dict[str, Any]:
    """A service of ``compose.yaml`` with what a second file says of it, as compose merges them."""
    merged = {**service, **added}
    for key, value in added.items():
        before = service.get(key, type(value)())
        if isinstance(value, dict):
            merged[key] = {**before, **value}
        elif key == "volumes":  # a mount replaces that at the same place
            places = {**mounts(service), **mounts(added)}
            merged[key] = [f"{source}:{target}" for target, source in places.items()]
        elif isinstance(value, list) and not isinstance(value, Override) and key != "command":
            merged[key] = [*before, *value]
    return merged
