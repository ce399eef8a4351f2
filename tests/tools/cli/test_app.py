"""The command line as a whole: help, version, and how little its start imports."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version

import pytest
from typer.testing import CliRunner

from onemap_shared.services import SERVICES
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_OK
from tests.tools.cli.commands import COMMANDS, TREE

RUNNER = CliRunner()


def test_every_service_is_a_command() -> None:
    assert {(name,) for name in SERVICES} < set(COMMANDS)


@pytest.mark.parametrize("words", [path for path, _ in TREE], ids=" ".join)
def test_every_command_explains_itself(words: tuple[str, ...]) -> None:
    result = RUNNER.invoke(app, [*words, "--help"])
    assert result.exit_code == EXIT_OK
    assert "usage: " in result.output.lower()


def test_the_codes_are_in_the_help() -> None:
    text = " ".join(RUNNER.invoke(app, ["--help"]).stdout.split())
    for part in ("0 yes or done", "1 no", "2 misused", "130 stopped", "'exit_code'"):
        assert part in text


def test_the_version_is_that_of_the_package() -> None:
    result = RUNNER.invoke(app, ["--version"])
    assert result.exit_code == EXIT_OK
    assert result.stdout == f"onemap {version('onemap')}\n"


def test_the_command_starts_without_what_it_does_not_need() -> None:
    """Heavy libraries are imported by the commands that need them."""
    code = (
        "import sys; import onemap_tools.cli.app\n"
        "heavy = {'torch', 'cv2', 'zenoh', 'fastapi', 'httpx', 'numpy', 'onnxruntime'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert result.stdout.strip() == "[]"


def test_sources_that_are_not_installed_have_no_version(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> str:
        raise PackageNotFoundError

    monkeypatch.setattr("onemap_tools.cli.app.installed_version", missing)
    assert "not installed" in RUNNER.invoke(app, ["--version"]).stdout
