"""``onemap map``: the requests it sends and what it prints of the replies."""

from __future__ import annotations

import json
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_OK
from tests.tools.fake_gateway import fake_gateway

RUNNER = CliRunner()
CHANGE = {"path": "flat.npz", "cells_observed": 81, "frames_fused": 9, "file_bytes": 2_500_000}


@pytest.mark.parametrize(
    ("words", "request_line", "printed"),
    [
        (("save", "flat"), "PUT /v1/maps/flat", "Saved flat.npz: 81 cells from 9 frames, 2.5 MB."),
        (
            ("load", "flat"),
            "POST /v1/maps/flat/load",
            "Loaded flat.npz: 81 cells from 9 frames, 2.5 MB.",
        ),
        (("clear",), "POST /v1/map/clear", "Cleared flat.npz: 81 cells from 9 frames, 2.5 MB."),
    ],
    ids=str,
)
def test_a_change_is_sent_and_printed(
    words: tuple[str, ...], request_line: str, printed: str
) -> None:
    method, path = request_line.split()
    with fake_gateway({(method, path): (200, CHANGE)}) as url:
        plain = RUNNER.invoke(app, ["map", *words, "--url", url])
        as_json = RUNNER.invoke(app, ["map", *words, "--url", url, "--json"])
    assert (plain.exit_code, plain.stdout) == (EXIT_OK, f"{printed}\n")
    assert json.loads(as_json.stdout) == CHANGE
    assert as_json.stderr == f"{printed}\n"


def test_info_is_the_gateways_document() -> None:
    info: dict[str, Any] = {
        "revision": 412,
        "age_s": 0.5,
        "bounds_m": [0.0, -1.0, 4.0, 5.0],
        "observed_m2": 20.0,
        "free_m2": 12.0,
        "occupied_m2": 6.5,
        "memory_bytes": 3_100_000,
        "rate_hz": 7.9,
        "update_ms": 21.0,
        "encoder_id": "mini-1",
        "text_space": "minilm",
    }
    with fake_gateway({("GET", "/v1/map"): (200, info)}) as url:
        result = RUNNER.invoke(app, ["map", "info", "--url", url, "--json"])
    assert json.loads(result.stdout) == info
    assert "4.0 x 6.0 m" in result.stderr
