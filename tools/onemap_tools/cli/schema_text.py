"""Formats the JSON schema of a configuration as text: type, limits, default and reason."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

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


@dataclass(frozen=True, slots=True)
class SchemaRow:
    """A section, a section within it, one of its variants, or a key.

    label: its full path; kind: allowed values in words; default: of a key, "required" if it has
    none; reason: its description in one line.
    """

    level: Literal["section", "group", "variant", "key"]
    label: str
    reason: str
    kind: str = ""
    default: str = ""

    def lines(self) -> Iterator[str]:
        """The row as text: a line, and the reason below it or in it."""
        if self.level in ("section", "variant"):
            yield f"{self.label}: {self.reason}"
            return
        yield f"{self.label}: {self.kind}{', ' if self.default else ''}{self.default}"
        yield from textwrap.wrap(
            self.reason, WIDTH, initial_indent=INDENT, subsequent_indent=INDENT
        )


class SchemaText:
    """Formats the keys of one schema; resolves references in its ``$defs``."""

    def __init__(self, schema: dict[str, Any]) -> None:
        self._schema = schema
        self._definitions: dict[str, Any] = schema.get("$defs", {})

    def lines(self) -> Iterator[str]:
        """A paragraph for each section, each key with its full path."""
        for number, row in enumerate(self.rows()):
            if number and row.level == "section":
                yield ""
            yield from row.lines()

    def rows(self) -> Iterator[SchemaRow]:
        """Every section, followed by its keys."""
        for name, entry in self._schema["properties"].items():
            model = self._resolved(entry)
            yield SchemaRow("section", name, _plain(model))
            yield from self._keys(name, model)

    def _keys(self, path: str, model: dict[str, Any]) -> Iterator[SchemaRow]:
        required = model.get("required", ())
        for name, entry in model.get("properties", {}).items():
            yield from self._key(f"{path}.{name}", entry, name in required)

    def _key(self, path: str, entry: dict[str, Any], required: bool) -> Iterator[SchemaRow]:
        models = [m for m in map(self._resolved, self._options(entry)) if "properties" in m]
        reason = _plain(entry)
        if models:
            key = entry.get("discriminator", {}).get("propertyName", "")
            yield SchemaRow(
                "group", path, reason, f"one of these, by {key}" if key else "a section"
            )
            for model in models:
                if key:
                    tag = model["properties"][key]["const"]
                    yield SchemaRow("variant", f"{path} with {key} {tag}", _plain(model))
                yield from self._keys(path, model)
            return
        value = entry.get("default")
        default = f"default {'none' if value is None else json.dumps(value)}"
        yield SchemaRow("key", path, reason, self._kind(entry), "required" if required else default)

    def _options(self, entry: dict[str, Any]) -> list[dict[str, Any]]:
        return entry.get("oneOf") or entry.get("anyOf") or [entry]

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


def _plain(entry: dict[str, Any]) -> str:
    """A description in one line."""
    return " ".join(entry.get("description", "").replace("``", "").split())
