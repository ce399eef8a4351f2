"""Formats the JSON schema of a configuration as text: type, limits, default and reason."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from typing import Any

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

    def _keys(self, path: str, model: dict[str, Any]) -> Iterator[str]:
        required = model.get("required", ())
        for name, entry in model.get("properties", {}).items():
            yield from self._key(f"{path}.{name}", entry, name in required)

    def _key(self, path: str, entry: dict[str, Any], required: bool) -> Iterator[str]:
        models = [m for m in map(self._resolved, self._options(entry)) if "properties" in m]
        if models:
            key = entry.get("discriminator", {}).get("propertyName", "")
            yield f"{path}: one of these, by {key}" if key else f"{path}: a section"
            yield from _reason(entry)
            for model in models:
                if key:
                    yield f"{path} with {key} {model['properties'][key]['const']}: {_plain(model)}"
                yield from self._keys(path, model)
            return
        value = entry.get("default")
        default = f"default {'none' if value is None else json.dumps(value)}"
        yield f"{path}: {self._kind(entry)}, {'required' if required else default}"
        yield from _reason(entry)

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


def _plain(model: dict[str, Any]) -> str:
    """A model's docstring in one line."""
    return " ".join(model.get("description", "").replace("``", "").split())


def _reason(entry: dict[str, Any]) -> Iterator[str]:
    text = entry.get("description", "")
    yield from textwrap.wrap(text, WIDTH, initial_indent=INDENT, subsequent_indent=INDENT)
