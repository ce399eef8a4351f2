"""Priorities in the journal, and the command that starts a service where a process runs."""

from __future__ import annotations

import logging

import pytest

from onemap_shared.supervisor import JournalFormatter, start_command


@pytest.mark.parametrize(
    ("level", "priority"),
    [
        (logging.CRITICAL, 2),
        (logging.ERROR, 3),
        (logging.WARNING, 4),
        (logging.INFO, 6),
        (logging.DEBUG, 7),
    ],
)
def test_each_line_has_the_priority_of_its_record(level: int, priority: int) -> None:
    record = logging.LogRecord("x", level, "x.py", 1, "one\ntwo", None, None)
    text = JournalFormatter(logging.Formatter("%(message)s")).format(record)
    assert text == f"<{priority}>one\n<{priority}>two"


@pytest.mark.parametrize(
    ("supervisor", "command"),
    [
        ("", "onemap planner"),
        ("systemd", "systemctl start onemap-planner"),
        ("compose", "docker compose up -d planner"),
    ],
)
def test_a_hint_names_the_command_that_works_here(
    supervisor: str, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ONEMAP_SUPERVISOR", supervisor)
    assert start_command("planner") == command
