"""The frame of ``make chaos``: what runs without its marker, a table and a JSON line at the end."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.chaos import conftest
from tests.chaos.report import BROKEN, HELD, Attack, ChaosResult, json_line, table_lines

CHAOS = Path(conftest.__file__).parent


@pytest.mark.parametrize(
    ("expression", "expected"), [("", ["quick", "other"]), ("chaos", ["quick", "long", "other"])]
)
def test_attacks_on_a_system_wait_for_their_marker(expression: str, expected: list[str]) -> None:
    marks: dict[str, set[str]] = {"quick": {"slow"}, "long": set(), "other": set()}

    def item(name: str) -> Any:
        return SimpleNamespace(
            name=name,
            path=(CHAOS.parent if name == "other" else CHAOS) / "test_a.py",
            add_marker=lambda mark: marks[name].add(mark.name),
            get_closest_marker=lambda mark: mark if mark in marks[name] else None,
        )

    deselected: list[int] = []
    hook = SimpleNamespace(pytest_deselected=lambda items: deselected.append(len(items)))
    config: Any = SimpleNamespace(option=SimpleNamespace(markexpr=expression), hook=hook)
    items = [item(name) for name in marks]
    conftest.pytest_collection_modifyitems(config, items)
    assert [each.name for each in items] == expected
    assert len(items) + sum(deselected) == len(marks)
    assert marks == {"quick": {"slow", "chaos"}, "long": {"chaos"}, "other": set()}


@pytest.mark.parametrize("path", sorted(CHAOS.glob("test_*.py")), ids=lambda path: path.stem)
def test_every_attack_that_needs_no_system_runs_with_all_tests(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert ("mark.slow" in text) != ("from tests.end_to_end" in text)


def test_an_attack_keeps_its_row_also_when_the_limit_is_broken() -> None:
    attack = Attack()
    attack.holds("25 kills", limit="0 files damaged", measured=0, held=True)
    with pytest.raises(AssertionError, match="25 kills: 2, the limit is 0 files damaged"):
        attack.holds("25 kills", limit="0 files damaged", measured=2, held=False)
    assert [(row.measured, row.verdict) for row in attack.rows] == [("0", HELD), ("2", BROKEN)]


def test_the_report_is_a_table_and_one_json_object() -> None:
    rows = [ChaosResult("kill", "30 s", "2.5 s", HELD), ChaosResult("flood", "1 s", "3 s", BROKEN)]
    assert table_lines(rows) == [
        "test  | limit | measured | verdict",
        "------+-------+----------+--------",
        "kill  | 30 s  | 2.5 s    | held",
        "flood | 1 s   | 3 s      | broken",
    ]
    document = json.loads(json_line(rows))
    assert (document["held"], document["broken"], document["skipped"]) == (1, 1, 0)
    assert document["results"][1]["measured"] == "3 s"
