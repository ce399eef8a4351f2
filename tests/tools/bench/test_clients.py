"""Many clients of a gateway: what is counted, and what a refusal is."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from onemap_tools.bench.clients import ClientsBenchParams, QueryTime, run, summarise
from onemap_tools.cli.app import app
from onemap_tools.gateway import gateway_client
from tests.tools.fake_gateway import Routes, fake_gateway

MAPPER = {
    "name": "mapper", "condition": "ready", "problem": "", "alive": True, "ready": True,
    "heartbeat_age_s": 0.1, "metrics": {"frames_fused": 7},
}  # fmt: skip
STATUS = {"services": [MAPPER]}
REPLY = {"text": "sofa", "regions": []}
ROUTES: Routes = {("POST", "/v1/queries"): (200, REPLY), ("GET", "/v1/status"): (200, STATUS)}


@pytest.mark.parametrize(("new_share", "kind"), [(0.0, "known"), (1.0, "new")])
def test_every_query_is_counted(new_share: float, kind: str) -> None:
    params = ClientsBenchParams(clients=3, seconds=0.2, new_share=new_share, pause_s=0.0)
    with fake_gateway(ROUTES) as url:
        result = run(lambda: gateway_client(url), params)
    other = {"known": "new", "new": "known"}[kind]
    assert result[kind]["queries"] >= 3
    assert result[kind]["refused"] == 0
    assert 0 <= result[kind]["p50_ms"] <= result[kind]["p99_ms"] <= result[kind]["max_ms"]
    assert (result[other]["queries"], result[other]["p50_ms"]) == (0, None)
    assert (result["clients"], result["fused_hz"]) == (3, 0.0)


def test_refusals_are_counted_with_the_first_reason() -> None:
    times = [QueryTime(True, 0.1), QueryTime(True, 3.0, "busy"), QueryTime(True, 3.0, "silent")]
    summary = summarise(times)
    assert (summary["queries"], summary["refused"], summary["first_refusal"]) == (3, 2, "busy")
    assert summary["max_ms"] == 100


def test_the_command_prints_a_table_or_one_object() -> None:
    with fake_gateway(ROUTES) as url:
        options = ["bench", "clients", "--url", url, "--clients", "2", "--seconds", "1"]
        result = CliRunner().invoke(app, [*options, "--pause", "0.1", "--json"])
        plain = CliRunner().invoke(app, [*options, "--pause", "0.1"])
    assert json.loads(result.stdout.splitlines()[-1])["clients"] == 2
    assert "queries_per_s" in plain.stdout


def test_without_a_gateway_it_says_so() -> None:
    result = CliRunner().invoke(app, ["bench", "clients", "--url", "http://127.0.0.1:1"])
    assert result.exit_code == 1
    assert "No gateway at" in result.output
