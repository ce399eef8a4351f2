"""What the doctor says and how the command ends."""

from __future__ import annotations

import io

from rich.console import Console

from onemap_tools.doctor.checks import Finding, Severity
from onemap_tools.doctor.report import describe, document, healthy

ERROR = Finding(Severity.ERROR, "The mapper is not running.", "Start it: onemap mapper.")
WARNING = Finding(Severity.WARNING, "The robot touches an obstacle [1].", "Let it back off.")


def said(findings: list[Finding]) -> str:
    console = Console(file=io.StringIO(), width=200)
    describe(findings, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_warnings_alone_are_healthy() -> None:
    assert healthy([])
    assert healthy([WARNING])
    assert not healthy([WARNING, ERROR])


def test_each_finding_is_a_line_with_its_remedy() -> None:
    lines = said([ERROR, WARNING]).splitlines()
    assert lines == [
        "error The mapper is not running. Start it: onemap mapper.",
        "warning The robot touches an obstacle [1]. Let it back off.",
    ]


def test_health_is_said_too() -> None:
    assert said([]).startswith("Nothing is wrong")


def test_a_note_is_no_failure_and_hides_no_health() -> None:
    note = Finding(Severity.NOTE, "The floor cannot be told yet.", "Drive or turn the robot.")
    assert healthy([note, WARNING])
    assert said([note]).splitlines() == [
        "note The floor cannot be told yet. Drive or turn the robot.",
        "Nothing is wrong that can be seen from here.",
    ]
    assert "Nothing is wrong" not in said([WARNING, note])


def test_the_document_is_complete() -> None:
    assert document([WARNING]) == {
        "healthy": True,
        "findings": [
            {
                "severity": "warning",
                "sentence": WARNING.sentence,
                "remedy": WARNING.remedy,
            }
        ],
    }
