"""The effective configuration, its mistakes, and the JSON schema of its sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic.json_schema import models_json_schema

from onemap_shared.config import SECTIONS, BusConfig, LogConfig, mistakes, read, section
from onemap_shared.params import Params
from onemap_shared.services import ROBOTS
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.services import section_model
from onemap_tools.processes.up import TWO_ROBOTS

COMMON: Mapping[str, type[Params]] = {"bus": BusConfig, "log": LogConfig}


@dataclass(frozen=True, slots=True)
class SectionModels:
    """The models of sections. ``missing``: why the models of other sections are not installed."""

    known: Mapping[str, type[Params]]
    missing: Mapping[str, str]


def installed_models() -> SectionModels:
    """The models of all sections whose packages are installed."""
    known: dict[str, type[Params]] = {}
    missing = {}
    for name in SECTIONS:
        try:
            known[name] = COMMON.get(name) or section_model(name)
        except CliError as error:
            missing[name] = str(error)
    return SectionModels(known, missing)


def effective(config: Path | None, models: SectionModels) -> dict[str, Any]:
    """The effective values of every section: defaults, file and environment; secrets are masked.

    Robots are included as ``onemap up`` would start them: those that the file has a section
    for, the simulator without a file. Raises ConfigError.
    """
    sections = read(config)
    robots = [name for name in ROBOTS if name in sections] if config else ["simulator"]
    return {
        name: section(sections, name, model).model_dump(mode="json")
        for name, model in models.known.items()
        if name not in ROBOTS or name in robots
    }


def check(config: Path | None, models: SectionModels) -> None:
    """CliError with one line for every mistake, if there is any."""
    sections = read(config)
    found = [
        sentence
        for name, model in models.known.items()
        for sentence in mistakes(sections, name, model)
    ]
    if len(set(ROBOTS) & set(sections)) > 1:
        found.append(TWO_ROBOTS)
    if found:
        raise CliError("\n".join(found), EXIT_USAGE_ERROR, {"ok": False, "mistakes": found})


def select(name: str, models: SectionModels) -> SectionModels:
    """Only the model of this section, or all if ``name`` is empty; CliError if there is none."""
    if not name:
        return models
    if name not in SECTIONS:
        raise CliError(
            f"There is no section {name!r}; there are {', '.join(SECTIONS)}.", EXIT_USAGE_ERROR
        )
    if name in models.missing:
        raise CliError(models.missing[name], EXIT_USAGE_ERROR)
    return SectionModels({name: models.known[name]}, {})


def schema(models: SectionModels) -> dict[str, Any]:
    """The JSON schema of a configuration file with these sections."""
    pairs = [(model, "validation") for model in models.known.values()]
    references, definitions = models_json_schema(pairs)  # type: ignore[arg-type]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "OneMap configuration",
        "type": "object",
        "additionalProperties": False,
        "properties": {
            name: references[(model, "validation")] for name, model in models.known.items()
        },
        **definitions,
    }
