"""``onemap search replay`` beside ``onemap search``."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_planner.search.decision_log import FOLDER, file_name, record
from onemap_shared.messages import SearchStatus
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_FAILED, EXIT_OK
from tests.shared.messages.broken import sample
from tests.tools.cli.commands import error_of

RUNNER = CliRunner()
STATUS = sample(SearchStatus)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    for number in range(3):
        record(tmp_path, replace(STATUS, reason=f"reason {number}"), (1.0, 2.0))
    return tmp_path / FOLDER / file_name(STATUS)


@pytest.mark.parametrize("options", [[], ["--all"]])
def test_without_a_terminal_all_steps_are_printed(path: Path, options: list[str]) -> None:
    result = RUNNER.invoke(app, ["search", "replay", str(path), *options])
    assert result.exit_code == EXIT_OK
    for text in ("Step 1 of 3", "Step 3 of 3", "reason 2", "the only goal", "frontier"):
        assert text in result.stdout


def test_on_a_terminal_enter_shows_the_next(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter([""])

    def answer(prompt: str) -> str:
        assert prompt.startswith("Enter: next step")
        try:
            return next(answers)
        except StopIteration:
            raise EOFError from None

    monkeypatch.setattr("builtins.input", answer)
    monkeypatch.setattr("onemap_tools.cli.terminal.sys", _Terminal())
    result = RUNNER.invoke(app, ["search", "replay", str(path)])
    assert result.exit_code == EXIT_OK
    assert "Step 2 of 3" in result.stdout
    assert "Step 3 of 3" not in result.stdout


class _Terminal:
    class stdin:  # noqa: N801 - stands for the attribute of ``sys``
        @staticmethod
        def isatty() -> bool:
            return True


def test_a_step_that_was_cut_off_is_said(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-5])
    result = RUNNER.invoke(app, ["search", "replay", str(path)])
    assert "Step 2 of 2" in result.stdout
    assert "The last line is not complete" in result.stdout


def test_as_json_it_is_one_object(path: Path) -> None:
    result = RUNNER.invoke(app, ["search", "replay", str(path), "--json"])
    assert len(json.loads(result.stdout)["steps"]) == 3


def test_a_damaged_file_is_one_sentence(path: Path) -> None:
    path.write_text("nonsense\n")
    result = RUNNER.invoke(app, ["search", "replay", str(path), "--json"])
    assert result.exit_code == EXIT_FAILED
    assert "line 1 is not a step of a search" in error_of(result)["error"]
    assert len(result.stderr.splitlines()) == 1


def test_help_names_it() -> None:
    assert "search replay" in RUNNER.invoke(app, ["--help"]).stdout
    assert "search replay FILE" in " ".join(RUNNER.invoke(app, ["search", "--help"]).stdout.split())
    assert "Usage: root search replay" in RUNNER.invoke(app, ["search", "replay", "--help"]).stdout
