"""Marks every test here ``chaos`` and reports at the end.

Attacks on what one process reads or writes are marked ``slow`` and run with all tests, with a tenth
of their attempts; those on a running system take minutes and run with ``-m chaos`` alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.chaos.report import BROKEN, HELD, SKIPPED, Attack, ChaosResult, json_line, table_lines
from tests.end_to_end.conftest import system

__all__ = ["system"]  # the fixture: every service and a simulated robot, ready

HERE = Path(__file__).parent
ROWS = pytest.StashKey[list[ChaosResult]]()
ATTACK = pytest.StashKey[Attack]()


def asked_for(config: pytest.Config) -> bool:
    """Whether the command is about attacks, as that of ``make chaos``."""
    return "chaos" in str(config.option.markexpr)


@pytest.fixture
def attack(request: pytest.FixtureRequest) -> Attack:
    """Records what a test measured: ``attack.holds(test, limit=, measured=, held=)``."""
    recorded = Attack(share=1.0 if asked_for(request.config) else SHARE)
    request.node.stash[ATTACK] = recorded
    return recorded


SHARE = 0.1  # of an attack's attempts, with all tests
LOOP_SECONDS = "--loop-seconds"
AROUND_S = 600.0  # for start, warm-up and end of a system


def pytest_addoption(parser: pytest.Parser) -> None:
    """The duration of the test that watches the loop."""
    parser.addoption(
        LOOP_SECONDS, type=float, default=120.0, help="s for which test_steady.py watches the loop"
    )


@pytest.fixture
def loop_s(pytestconfig: pytest.Config) -> float:
    """Seconds for which the loop is watched."""
    return float(pytestconfig.getoption(LOOP_SECONDS))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the attacks; deselect those on a system unless the command asks for them."""
    attacks = [item for item in items if HERE in item.path.parents]
    for item in attacks:
        item.add_marker(pytest.mark.chaos)
        if isinstance(item, pytest.Function) and "loop_s" in item.fixturenames:
            limit_s = config.getoption(LOOP_SECONDS) + AROUND_S
            item.add_marker(pytest.mark.timeout(limit_s))
    if not asked_for(config):
        long = [item for item in attacks if item.get_closest_marker("slow") is None]
        config.hook.pytest_deselected(items=long)
        items[:] = [item for item in items if item not in long]


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Keep the rows of a test; one that ends otherwise is a row of its own."""
    outcome: Any = yield
    report: pytest.TestReport = outcome.get_result()
    if item.get_closest_marker("chaos") is None:
        return
    rows = item.config.stash.setdefault(ROWS, [])
    recorded = item.stash.get(ATTACK, Attack()).rows if report.when == "call" else []
    if report.when == "call" and report.passed and not recorded:
        recorded = [ChaosResult(item.name, "", "", HELD)]
    rows += recorded
    if report.skipped and isinstance(report.longrepr, tuple):
        rows.append(ChaosResult(item.name, "", report.longrepr[2], SKIPPED))
    elif report.failed and not any(row.verdict == BROKEN for row in recorded):
        reason = report.longreprtext.strip().splitlines()
        rows.append(ChaosResult(item.name, "", reason[-1][:120] if reason else "", BROKEN))


def pytest_unconfigure(config: pytest.Config) -> None:
    """The table and, as the last line, the JSON object."""
    rows = config.stash.get(ROWS, [])
    if rows:
        print("\n".join(("", *table_lines(rows), json_line(rows))))
