"""Recorded decisions are read and described; a damaged file is refused in one sentence."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_planner.search.decision_log import FOLDER, file_name, record
from onemap_shared.messages import NO_CHOICE, SearchState, SearchStatus
from onemap_tools.cli.app import app
from onemap_tools.cli.decision_file import decisions_document, read_decisions
from onemap_tools.errors import EXIT_OK, CliError
from tests.gateway.fakes import FakePlanner, past_search
from tests.memory_bus import MemoryRouter
from tests.shared.samples import sample

STATUS = sample(SearchStatus)
RUNNER = CliRunner()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    record(tmp_path, STATUS, (1.0, 2.0))
    ended = replace(STATUS, state=SearchState.CANCELLED, reason="cancelled", choice=NO_CHOICE)
    record(tmp_path, ended, None)
    return tmp_path / FOLDER / file_name(STATUS)


def test_the_document_holds_every_step(path: Path) -> None:
    document = decisions_document(read_decisions(path))
    assert (document["id"], document["state"], document["cut_off"]) == ("s1", "cancelled", False)
    assert [step["state"] for step in document["steps"]] == ["exploring", "cancelled"]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "holds no decision"),
        (b"\xff\xfe\n", "is not text"),
        (b"{}\n", "line 1 is not a step of a search (KeyError('schema'))"),
        (b'{"schema": 9}\n', "schema 9, this version reads 1"),
        (b"x" * 4_000_001, "has 4.0 MB"),
    ],
)
def test_a_damaged_file_is_refused_in_a_sentence(
    tmp_path: Path, content: bytes, sentence: str
) -> None:
    path = tmp_path / "broken.jsonl"
    path.write_bytes(content)
    with pytest.raises(CliError) as refused:
        read_decisions(path)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.fixture
def three(tmp_path: Path) -> Path:
    for number in range(3):
        record(tmp_path, replace(STATUS, reason=f"reason {number}"), (1.0, 2.0))
    return tmp_path / FOLDER / file_name(STATUS)


@pytest.mark.parametrize("options", [[], ["--all"]])
def test_without_a_terminal_all_steps_are_printed(three: Path, options: list[str]) -> None:
    result = RUNNER.invoke(app, ["search", "replay", str(three), *options])
    assert result.exit_code == EXIT_OK
    for text in ("Step 1 of 3", "Step 3 of 3", "reason 2", "Decision 3:", "frontier"):
        assert text in result.stdout


def test_on_a_terminal_enter_shows_the_next(three: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter([""])

    def answer(prompt: str) -> str:
        assert prompt.startswith("Enter: next step")
        try:
            return next(answers)
        except StopIteration:
            raise EOFError from None

    monkeypatch.setattr("builtins.input", answer)
    monkeypatch.setattr("onemap_tools.cli.terminal.sys", _Terminal())
    result = RUNNER.invoke(app, ["search", "replay", str(three)])
    assert result.exit_code == EXIT_OK
    assert "Step 2 of 3" in result.stdout
    assert "Step 3 of 3" not in result.stdout


class _Terminal:
    class stdin:  # noqa: N801 - stands for the attribute of ``sys``
        @staticmethod
        def isatty() -> bool:
            return True


def test_a_step_that_was_cut_off_is_said(three: Path) -> None:
    three.write_bytes(three.read_bytes()[:-5])
    result = RUNNER.invoke(app, ["search", "replay", str(three)])
    assert "Step 2 of 2" in result.stdout
    assert "The last line is not complete" in result.stdout


def test_a_running_robot_tells_its_past_searches() -> None:
    router = MemoryRouter()
    FakePlanner(router, past=[past_search()])
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        url = ["--url", f"http://127.0.0.1:{worker.port}"]
        listed = RUNNER.invoke(app, ["search", "list", *url])
        for text in ("2026-01-01 00:00:00", "sofa", "found", "10 s", "2.0 m", "s0"):
            assert text in listed.stdout
        told = RUNNER.invoke(app, ["search", "replay", "s0", *url])
        assert told.exit_code == EXIT_OK
        for text in (
            "Step 2 of 3, after 6.0 s, robot at (0.6, 0.5)",
            "sofa: approaching: walking up to what looks like a sofa",
            "Goal: detection at (1.0, 1.0).",
            "4 steps are left out.",
        ):
            assert text in told.stdout
