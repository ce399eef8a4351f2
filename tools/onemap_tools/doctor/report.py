"""Runs ``onemap doctor``: observe the bus, diagnose, print the findings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from onemap_shared.config import BusConfig, read, section
from onemap_tools.doctor.checks import Finding, Severity, diagnose
from onemap_tools.doctor.observe import observe
from onemap_tools.processes.session import temporary_session

CONNECT_S = 3.0
LISTEN_S = 3.5  # three heartbeats of every service
COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "dim"}


def examine(config: Path | None, console: Console) -> list[Finding]:
    """Observe the bus of this configuration for ``LISTEN_S`` and diagnose."""
    with temporary_session(section(read(config), "bus", BusConfig), "doctor", CONNECT_S) as bus:
        console.print(f"Listening for {LISTEN_S:g} s ...", style="dim")
        return diagnose(observe(bus, LISTEN_S))


def describe(findings: list[Finding], console: Console) -> None:
    """Print each finding with its remedy."""
    for finding in findings:
        severity = Text(str(finding.severity), style=COLOURS[finding.severity])
        console.print(severity, Text(f"{finding.sentence} {finding.remedy}"))
    if all(finding.severity is Severity.NOTE for finding in findings):
        console.print("Nothing is wrong that can be seen from here.")


def healthy(findings: list[Finding]) -> bool:
    """Whether there is no error; warnings and notes are allowed."""
    return all(finding.severity is not Severity.ERROR for finding in findings)


def document(findings: list[Finding]) -> dict[str, Any]:
    """The findings as a JSON object."""
    return {
        "healthy": healthy(findings),
        "findings": [
            {"severity": str(f.severity), "sentence": f.sentence, "remedy": f.remedy}
            for f in findings
        ],
    }
