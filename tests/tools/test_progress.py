"""The display of a running search."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

from rich.console import Console

from onemap_tools.progress import LINE_EVERY_S, ProgressLines, SearchProgress

REPORT: dict[str, Any] = {
    "elapsed_s": 12.0,
    "objects": ["sofa", "bed"],
    "results": [{"name": "sofa", "outcome": "not_found"}],
    "target": "bed",
    "state": "exploring",
    "reason": "walking [to] a frontier",
    "path_length_m": 3.25,
}
PROGRESS = SearchProgress(REPORT, 0.2, 5.0, (1.0, -2.0))


def console() -> Console:
    return Console(file=io.StringIO(), markup=False, width=200)


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_line_comes_at_a_change_and_every_five_seconds_for_each_robot() -> None:
    out = console()
    lines = ProgressLines(out)
    for elapsed_s in (0.0, 1.0, LINE_EVERY_S + 0.1, LINE_EVERY_S + 0.2):
        lines.wait(elapsed_s, "no frame")
    lines.wait(LINE_EVERY_S + 0.3, "no map")
    assert len(text_of(out).splitlines()) == 3
    for name in ("r1", "r2", "r1", "r2"):
        lines.show(replace(PROGRESS, name=name))
    assert [line.split()[2] for line in text_of(out).splitlines()[3:]] == ["r1", "r2"]
