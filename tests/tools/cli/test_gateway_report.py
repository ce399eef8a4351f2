"""What is printed of the gateway's replies, and the archive that is written."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest
from rich.console import Console

from onemap import QueryInterrupted, QueryResult
from onemap_gateway.present.queries import QueryReply
from onemap_tools.cli.gateway_report import (
    describe_change,
    describe_info,
    describe_objects,
    describe_query,
    describe_search,
    describe_status,
    follow_query,
)

CHANGE = {
    "path": "/maps/flat.npz",
    "cells_observed": 81,
    "frames_fused": 9,
    "file_bytes": 2_500_000,
}
INFO = {
    "revision": 412,
    "age_s": None,
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
STATUS = {
    "ready": False,
    "problem": "The mapper is not running.",
    "services": [{"name": "mapper", "condition": "down", "problem": "It is [not] running."}],
    "streams": [
        {
            "name": "rgbd",
            "age_s": None,
            "rate_hz": 0.0,
            "received": 0,
            "missed": 0,
            "refused": 0,
        }
    ],
}


@pytest.fixture
def console() -> Console:
    return Console(file=io.StringIO(), width=200)


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_saved_map_has_path_and_size(console: Console) -> None:
    describe_change("Saved")(CHANGE, console)
    assert text_of(console) == "Saved /maps/flat.npz: 81 cells from 9 frames, 2.5 MB.\n"


def test_a_cleared_map_has_no_path(console: Console) -> None:
    empty = {"path": "", "cells_observed": 0, "frames_fused": 0, "file_bytes": 0}
    describe_change("Cleared")(empty, console)
    assert text_of(console) == "Cleared: 0 cells from 0 frames.\n"


def test_the_map_in_numbers(console: Console) -> None:
    describe_info(INFO, console)
    for part in ("412", "empty", "4.0 x 6.0 m", "20.0 m2", "3.1 MB", "mini-1 (minilm)"):
        assert part in text_of(console)


def test_status_names_what_is_missing(console: Console) -> None:
    describe_status(STATUS, console)
    for part in ("mapper", "down", "It is [not] running.", "never", "Not ready. The mapper"):
        assert part in text_of(console)


def test_an_object_that_was_not_found_has_its_reason(console: Console) -> None:
    result = {
        "name": "sofa",
        "outcome": "not_found",
        "reason": "searched all rooms",
        "position_m": None,
        "duration_s": 30.0,
        "path_length_m": 7.5,
    }
    report = {"objects": ["sofa"], "results": [result], "reason": "sofa was not found"}
    describe_search(report, console)
    for part in ("not found", "searched all rooms", "30 s", "7.5 m", "sofa was not found"):
        assert part in text_of(console)


def test_a_found_object_has_its_position(console: Console) -> None:
    result = {
        "name": "sofa",
        "outcome": "found",
        "reason": "confirmed",
        "position_m": [1.0, 2.0, 0.4],
        "duration_s": 30.0,
        "path_length_m": 7.5,
    }
    describe_search({"objects": ["sofa"], "results": [result], "reason": "all found"}, console)
    assert "(1.00, 2.00, 0.40) m" in text_of(console)
    assert "all found" not in text_of(console)


def test_a_query_lists_places_best_first(console: Console) -> None:
    region: dict[str, Any] = {
        "rank": 1,
        "centre_m": [2.35, -1.1],
        "extent_m": [1.5, -1.6, 3.2, -0.6],
        "score": 0.91,
    }
    reply = {"text": "sofa", "regions": [region], "did_you_mean": []}
    describe_query(reply, console)
    assert "did you mean" not in text_of(console)
    describe_query({**reply, "did_you_mean": ["couch", "bed"]}, console)
    assert "did you mean 'couch' or 'bed'?" in text_of(console)
    assert "(2.35, -1.10) m" in text_of(console)
    assert "1.7 x 1.0 m" in text_of(console)


def test_a_query_says_its_verdict_and_from_where_it_was_seen(console: Console) -> None:
    (found, absent) = QueryReply.model_json_schema()["examples"]
    describe_query(found, console)
    assert "'sofa' is at (2.35, -1.10) m, with the score 0.91." in text_of(console)
    assert "(0.60, -0.40) m, -22" in text_of(console)
    assert "00:00:12" in text_of(console)
    assert "0.1 to 0.9 m" in text_of(console)
    describe_query(absent, console)
    said = " ".join(text_of(console).split())
    assert "was not seen, but only 62 % of the reachable area was looked at" in said


def test_a_followed_query_prints_each_answer(capsys: pytest.CaptureFixture[str]) -> None:
    (found, absent) = QueryReply.model_json_schema()["examples"]
    results = [QueryResult.of(each) for each in (absent, found)]
    follow_query([results[0], QueryInterrupted("The mapper is away."), results[1]], as_json=True)
    said = capsys.readouterr()
    assert [json.loads(line)["text"] for line in said.out.splitlines()] == ["skateboard", "sofa"]
    assert "The mapper is away." in said.err
    follow_query(results, as_json=False)
    assert "'sofa' is at (2.35, -1.10) m" in capsys.readouterr().out


def test_a_query_without_a_match_has_a_message(console: Console) -> None:
    why = "Nothing on the map looks like 'yeti': the best score is 0.04. Did you mean 'bed'?"
    describe_query({"text": "yeti", "regions": [], "message": why}, console)
    assert why in " ".join(text_of(console).split())


def test_found_objects_have_a_row_each(console: Console) -> None:
    found = {
        "id": "3f9a12c4",
        "name": "bed [old]",  # no markup
        "position_m": [3.42, -1.15, 0.41],
        "score": 0.934,
        "times_found": 2,
        "last_seen_at": "2026-01-01T00:09:51.000Z",
    }
    describe_objects([found], console)
    text = text_of(console)
    for part in ("bed [old]", "(3.42, -1.15, 0.41) m", "0.93", "2 x", "2026-01-01 00:09:51"):
        assert part in text


def test_without_objects_it_says_so(console: Console) -> None:
    describe_objects([], console)
    assert "Nothing was found on this map yet" in text_of(console)
