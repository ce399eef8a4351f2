"""The display of a running search."""

from __future__ import annotations

import io
from typing import Any

import httpx
from rich.console import Console

from onemap import Client
from onemap_tools.progress import LINE_EVERY_S, ProgressLines

REPORT: dict[str, Any] = {
    "elapsed_s": 12.0,
    "objects": ["sofa", "bed"],
    "results": [{"name": "sofa", "outcome": "not_found"}],
    "target": "bed",
    "state": "exploring",
    "reason": "walking [to] a frontier",
    "path_length_m": 3.25,
}


def silent(_: httpx.Request) -> httpx.Response:
    return httpx.Response(503, json={"detail": "not now"})


def test_a_line_comes_at_a_change_and_every_five_seconds() -> None:
    out = Console(file=io.StringIO(), markup=False, width=200)
    lines, gateway = ProgressLines(out), Client(transport=httpx.MockTransport(silent))
    for elapsed_s in (0.0, 1.0, LINE_EVERY_S + 0.1, LINE_EVERY_S + 0.2):
        lines.wait(elapsed_s, "no frame")
    lines.wait(LINE_EVERY_S + 0.3, "The map starts.")
    lines.wait(LINE_EVERY_S + 0.4, "The map starts, for 3 s so far.")
    assert isinstance(out.file, io.StringIO)
    assert len(out.file.getvalue().splitlines()) == 3
    for state in ("exploring", "exploring", "approaching"):
        lines.show({**REPORT, "state": state}, gateway)
    shown = out.file.getvalue().splitlines()[3:]
    assert [line.split(": ")[1] for line in shown] == ["exploring", "approaching"]
    assert shown[0].endswith("[1/2] bed: exploring: walking [to] a frontier; robot drove 3.2 m")
