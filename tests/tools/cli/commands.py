"""Every command of the command line, and what the tests read from its results."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import typer

from onemap_tools.cli.app import app


def walk(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every group and command below this one with its words."""
    yield path, group
    for name, command in getattr(group, "commands", {}).items():
        yield from walk(command, (*path, name))


TREE = tuple(walk(typer.main.get_command(app)))
COMMANDS = sorted(path for path, command in TREE if not hasattr(command, "commands"))


def error_of(result: Any) -> dict[str, Any]:
    """The error object of a result; stderr must hold an error too, without a traceback."""
    document: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    assert document["exit_code"] == result.exit_code
    assert document["error"]
    assert result.stderr
    assert "Traceback" not in result.output
    return document
