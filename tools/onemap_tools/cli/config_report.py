"""The effective configuration, its mistakes, and the schema of its sections, as JSON and text."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic.json_schema import models_json_schema

from onemap_shared.config import SECTIONS, BusConfig, LogConfig, mistakes, read, section
from onemap_shared.params import Params
from onemap_shared.services import ROBOTS
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.services import section_model
from onemap_tools.processes.up import TWO_ROBOTS

COMMON: Mapping[str, type[Params]] = {"bus": BusConfig, "log": LogConfig}
WIDTH = 96
INDENT = "    "
LIMITS = (
    ("exclusiveMinimum", "> "),
    ("minimum", ">= "),
    ("exclusiveMaximum", "< "),
    ("maximum", "<= "),
)
FORMATS = {"path": "path", "password": "secret text"}
TYPES = {
    "string": "text",
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
    "object": "keys and values",
    "null": "none",
}


class SectionModels(NamedTuple):
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
    found: list[str] = []
    sections = read(config, wrong=found)
    found += [
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


class SchemaText:
    """Formats the keys of one schema; resolves references in its ``$defs``."""

    def __init__(self, schema: dict[str, Any]) -> None:
        self._schema = schema
        self._definitions: dict[str, Any] = schema.get("$defs", {})

    def lines(self) -> Iterator[str]:
        """A paragraph for each section, each key with its full path."""
        for number, (name, entry) in enumerate(self._schema["properties"].items()):
            model = self._resolved(entry)
            if number:
                yield ""
            yield f"{name}: {_plain(model)}"
            yield from self._keys(name, model)

    def _keys(self, section: str, model: dict[str, Any]) -> Iterator[str]:
        for name, entry in model.get("properties", {}).items():
            path = f"{section}.{name}"
            choices = entry.get("oneOf") or entry.get("anyOf") or [entry]
            models = [each for each in map(self._resolved, choices) if "properties" in each]
            if not models:
                given = entry.get("default")
                default = f"default {'none' if given is None else json.dumps(given)}"
                value = "required" if name in model.get("required", ()) else default
                yield f"{path}: {self._kind(entry)}, {value}"
                yield from _reason(entry)
                continue
            key = entry.get("discriminator", {}).get("propertyName", "")
            yield f"{path}: {f'one of these, by {key}' if key else 'a section'}"
            yield from _reason(entry)
            for each in models:
                if key:
                    tag = each["properties"][key]["const"]
                    yield f"{path} with {key} {tag}: {_plain(each)}"
                yield from self._keys(path, each)

    def _resolved(self, entry: dict[str, Any]) -> dict[str, Any]:
        reference = entry.get("$ref")
        return self._definitions[reference.rpartition("/")[2]] if reference else entry

    def _kind(self, entry: dict[str, Any]) -> str:
        """The allowed values of a key, in words."""
        entry = {**self._resolved(entry), **entry}
        if "const" in entry:
            return json.dumps(entry["const"])
        if "enum" in entry:
            return " or ".join(map(json.dumps, entry["enum"]))
        if "anyOf" in entry:
            return " or ".join(map(self._kind, entry["anyOf"]))
        if "prefixItems" in entry:
            return f"[{', '.join(map(self._kind, entry['prefixItems']))}]"
        if "items" in entry:
            return f"list of {self._kind(entry['items'])}"
        kind = FORMATS.get(entry.get("format", "")) or TYPES[entry["type"]]
        limits = [f"{sign}{entry[name]:g}" for name, sign in LIMITS if name in entry]
        return " ".join([kind, " and ".join(limits)]).rstrip()


def _reason(entry: dict[str, Any]) -> list[str]:
    """The description of a key, indented."""
    return textwrap.wrap(_plain(entry), WIDTH, initial_indent=INDENT, subsequent_indent=INDENT)


def _plain(entry: dict[str, Any]) -> str:
    """A description in one line."""
    return " ".join(entry.get("description", "").replace("``", "").split())
