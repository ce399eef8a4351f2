"""The files of ``deploy/`` and what the services read, for the tests beside this one."""

from __future__ import annotations

import importlib.util
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import yaml
from pydantic import BaseModel

from onemap_tools.cli.config_report import installed_models
from onemap_tools.processes.services import CORE
from tests.structure import ROOT

DEPLOY = ROOT / "deploy"
CONFIGURATIONS = sorted((DEPLOY / "config").glob("*.yaml"))
PRESETS = sorted((DEPLOY / "config" / "robots").glob("*.yaml"))
UNITS = DEPLOY / "systemd"
COMMON = UNITS / "onemap-.service.d" / "common.conf"
ROLES = ("simulator", *CORE)


def script(name: str) -> ModuleType:
    """A script of ``deploy`` as a module."""
    spec = importlib.util.spec_from_file_location(name, DEPLOY / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


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


# With compose.tls.yaml each container shows a certificate.
TLS_PORT = 7448
TLS = {n: with_file(compose()[n], added) for n, added in compose("compose.tls.yaml").items()}


def secrets_of(name: str) -> dict[str, Path]:
    """Path in the container to the file in ``deploy``, of what a container is given to read."""
    known = compose_document("compose.tls.yaml")["secrets"]
    entries = [{"source": s} if isinstance(s, str) else s for s in TLS[name]["secrets"]]
    return {
        str(Path("/run/secrets") / entry.get("target", entry["source"])): Path(
            known[entry["source"]]["file"]
        )
        for entry in entries
        if entry["source"] in known  # the token is in compose.yaml
    }


def endpoint_of(name: str) -> str:
    """Where the service of a container connects over TLS."""
    (connect,) = json.loads(TLS[name]["environment"]["ONEMAP__BUS__CONNECT"])
    return str(connect)


def settings(path: Path) -> dict[str, list[str]]:
    """Every ``Key=value`` of a unit file; a key may come several times."""
    found: dict[str, list[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith(("#", "[")):
            key, _, value = line.partition("=")
            found.setdefault(key, []).append(value)
    return found
