"""The example runs as it is against a gateway on a socket, and stands in the documentation."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from tests.structure import ROOT
from tests.tools.fake_gateway import Routes, fake_gateway

SCRIPT = ROOT / "examples" / "find.py"
FOUND = {"name": "sofa", "outcome": "found", "position_m": [1.0, 2.0, 0.4]}
REPORT: dict[str, Any] = {"id": "s1", "objects": ["sofa"], "target": "sofa", "reason": "walking"}
REGION = {"rank": 1, "centre_m": [2.35, -1.1], "extent_m": [1.5, -1.6, 3.2, -0.6], "score": 0.91}


def gateway_with(state: str, *results: dict[str, Any]) -> Routes:
    """A gateway whose searches end in this state."""
    started = {**REPORT, "state": "exploring", "results": []}
    ended = {**REPORT, "state": state, "target": "", "reason": "done", "results": list(results)}
    events = "".join(f"event: status\ndata: {json.dumps(each)}\n\n" for each in (started, ended))
    return {
        ("POST", "/v1/queries"): (200, {"text": "sofa", "regions": [REGION]}),
        ("POST", "/v1/searches"): (201, started),
        ("GET", "/v1/searches/s1/events"): (200, events.encode()),
    }


def find(routes: Routes) -> subprocess.CompletedProcess[str]:
    with fake_gateway(routes) as url:
        command = [sys.executable, str(SCRIPT), "sofa", url]
        return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("routes", "code", "last"),
    [
        (gateway_with("found", FOUND), 0, "sofa: found at (1.0, 2.0, 0.4)"),
        (gateway_with("cancelled"), 1, "search: cancelled: done"),
    ],
    ids=["found", "cancelled"],
)
def test_it_prints_places_events_and_results(routes: Routes, code: int, last: str) -> None:
    done = find(routes)
    lines = done.stdout.splitlines()
    assert (done.returncode, done.stderr) == (code, "")
    assert lines[:2] == ["maybe at (2.35, -1.10) m, score 0.91", "sofa: exploring: walking"]
    assert lines[-1] == last


def test_a_refusal_is_one_sentence() -> None:
    problem = {"status": 409, "detail": "The robot is searching for 'bed'.", "search_id": "s0"}
    done = find({**gateway_with("found"), ("POST", "/v1/searches"): (409, problem)})
    assert (done.returncode, done.stderr) == (1, "The robot is searching for 'bed'.\n")
