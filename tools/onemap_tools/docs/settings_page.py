"""The page of settings: every key of the configuration with its type, default and reason."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from onemap_tools.cli.schema_text import SchemaRow, SchemaText

PREFIX = "ONEMAP__"
HEADER = """<!-- Generated: change the code, then run `make docs-pages`. -->
# Settings

Every process reads the same YAML file (`--config FILE`): its own section, `bus` and `log`. What
the file leaves out has its default. An environment variable overrides a key of the file; its value
is YAML too. An unknown key is refused, with the nearest valid name.

`onemap config schema` prints this list, `onemap config check --config FILE` reports every mistake,
`onemap config show --config FILE` prints the values that take effect.
"""
TABLE = ("| key, variable | type and limits | default | reason |", "|---|---|---|---|")


def settings_page(schema: Mapping[str, Any], root: Path) -> str:
    """The page as Markdown; paths below ``root`` are written relative to it."""
    lines = [HEADER]
    for row in SchemaText(dict(schema)).rows():
        if row.level == "section":
            lines += ["", f"## {row.label}", "", _cell(row.reason), "", *TABLE]
        else:
            lines.append("| " + " | ".join(_cells(row, root)) + " |")
    return "\n".join(lines).replace("\n\n\n", "\n\n") + "\n"


def _cells(row: SchemaRow, root: Path) -> Iterator[str]:
    name = f"`{row.label}`"
    if row.level == "variant":
        yield f"**{name}**"
    elif row.level == "group":
        yield name
    else:
        variable = PREFIX + row.label.replace(".", "__").upper()
        yield f"{name}<br>`{variable}`"
    yield _cell(row.kind)
    default = row.default.removeprefix("default ").replace(f'"{root}/', '"')
    yield f"`{default}`" if default not in ("", "required", "none") else default
    yield _cell(row.reason)


def _cell(text: str) -> str:
    """Text that Markdown shows as it is, in a cell of a table."""
    for character, shown in (("<", "&lt;"), ("|", "\\|"), ("*", "\\*")):
        text = text.replace(character, shown)
    return text
