"""The printed findings and their document."""

from __future__ import annotations

import io

from rich.console import Console

from onemap_tools.doctor.checks import Finding, Severity
from onemap_tools.doctor.report import describe, document, healthy

ERROR = Finding(Severity.ERROR, "The mapper is not running.", "Start it: onemap mapper.")
WARNING = Finding(Severity.WARNING, "The robot touches an obstacle [1].", "Let it back off.")


def printed(findings: list[Finding]) -> str:
    console = Console(file=io.StringIO(), width=200)
    describe(findings, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_warnings_alone_are_healthy() -> None:
    assert healthy([])
    assert healthy([WARNING])
    assert not healthy([WARNING, ERROR])


def test_each_finding_is_a_line_with_its_remedy() -> None:
    lines = printed([ERROR, WARNING]).splitlines()
    assert lines == [
        "error The mapper is not running. Start it: onemap mapper.",
        "warning The robot touches an obstacle [1]. Let it back off.",
    ]


def test_without_findings_health_is_printed() -> None:
    assert printed([]).startswith("Nothing is wrong")


def test_notes_are_healthy() -> None:
    note = Finding(Severity.NOTE, "The floor is unknown so far.", "Drive or turn the robot.")
    assert healthy([note, WARNING])
    assert printed([note]).splitlines() == [
        "note The floor is unknown so far. Drive or turn the robot.",
        "Nothing is wrong that can be seen from here.",
    ]
    assert "Nothing is wrong" not in printed([WARNING, note])


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
