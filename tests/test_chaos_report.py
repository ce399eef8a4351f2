"""The frame of ``make chaos``: deselected by default, a table and a JSON line at the end."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.chaos.report import BROKEN, HELD, Attack, ChaosResult, json_line, table_lines

ROOT = Path(__file__).parents[1]


MARKERS = (None, "slow", "chaos")
COLLECT = """
import json, sys, pytest
for marker in json.loads(sys.argv[1]):
    print("@next", flush=True)
    selection = [] if marker is None else ["-m", marker]
    pytest.main(["tests/chaos", "--collect-only", "-q", *selection])
"""


@pytest.fixture(scope="module")
def collected() -> dict[str | None, str]:
    """What pytest collects of the attacks with each marker, all in one process."""
    command = [sys.executable, "-c", COLLECT, json.dumps(MARKERS)]
    result = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=200, check=True
    )
    outputs = result.stdout.split("@next\n")[1:]
    return dict(zip(MARKERS, outputs, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("marker", [None, "slow"])
def test_no_attack_runs_unless_the_marker_asks_for_it(
    marker: str | None, collected: dict[str | None, str]
) -> None:
    assert "deselected" in collected[marker]
    assert "::test_" not in collected[marker]


@pytest.mark.slow
def test_the_marker_selects_every_attack(collected: dict[str | None, str]) -> None:
    assert "test_wire.py::test_mutated_messages" in collected["chaos"]


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
