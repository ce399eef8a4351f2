"""The commands of compose and systemd are valid command lines."""

from __future__ import annotations

import shlex
from typing import Any

import pytest
import typer.main

from onemap_tools.cli.app import app
from tests.deploy.deployment import DEPLOY, ROLES, UNITS, compose, settings

COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]


def check(arguments: list[str]) -> None:
    """Parse a command line without running it; raises the usage error."""
    name, *rest = arguments
    COMMANDS[name].make_context(name, rest)


@pytest.mark.parametrize("role", ROLES)
def test_compose_starts_and_checks_with_commands_that_exist(role: str) -> None:
    service = compose()[role]
    check(service["command"])
    executable, *arguments = service["healthcheck"]["test"][1:]
    if executable == "onemap":
        check(arguments)


@pytest.mark.parametrize("name", ["router", *ROLES[1:]])
def test_systemd_starts_commands_that_exist(name: str) -> None:
    _, *arguments = shlex.split(settings(UNITS / f"onemap-{name}.service")["ExecStart"][0])
    check(arguments)


def test_the_certificates_of_the_document_are_made_with_a_command_that_exists() -> None:
    text = (DEPLOY / "security.md").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.startswith("onemap certs")]
    assert lines
    for line in lines:
        check(shlex.split(line.partition("#")[0])[1:])
