"""Each step of a search is a line that the client reads; files are bounded, and survive a crash."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from onemap import SearchSnapshot
from onemap_planner.search import decision_log
from onemap_planner.search.decision_log import FOLDER, file_name, record
from onemap_shared.messages import SearchState, SearchStatus
from tests.shared.samples import sample

STATUS = replace(sample(SearchStatus), started_ns=10**18, updated_ns=10**18 + 2_500_000_000)
ENDED = replace(STATUS, state=SearchState.FOUND)


def lines(folder: Path) -> list[str]:
    return (folder / FOLDER / file_name(STATUS)).read_text().splitlines()


def test_a_line_is_a_reply_of_the_gateway_with_the_robots_place(tmp_path: Path) -> None:
    record(tmp_path, STATUS, (1.5, -2.0))
    record(tmp_path, ENDED, None)
    first, second = (json.loads(line) for line in lines(tmp_path))
    assert (first["schema"], first["robot_xy_m"], second["robot_xy_m"]) == (1, [1.5, -2.0], None)
    snapshot = SearchSnapshot.of(first)
    assert (snapshot.id, snapshot.target, snapshot.elapsed_s) == ("s1", "bed", 2.5)
    assert snapshot.choice is not None
    assert snapshot.choice.sentence == STATUS.choice.sentence
    assert snapshot.choice.options[0].xy_m == STATUS.choice.options[0].xy_m
    assert SearchSnapshot.of(second).state == "found"


def test_files_are_named_by_time_and_search() -> None:
    assert file_name(STATUS) == "20010909T014640Z-s1.jsonl"


def test_a_line_that_was_cut_off_is_removed_before_the_next(tmp_path: Path) -> None:
    record(tmp_path, STATUS, None)
    path = tmp_path / FOLDER / file_name(STATUS)
    whole = path.read_bytes()
    path.write_bytes(whole + whole[:40])
    record(tmp_path, STATUS, None)
    assert path.read_bytes() == whole + whole


def test_only_the_newest_files_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision_log, "MAX_FILES", 3)
    for number in range(5):
        later = replace(STATUS, search_id=f"s{number}", started_ns=10**18 + number * 10**9)
        record(tmp_path, later, None)
    names = sorted(path.name for path in (tmp_path / FOLDER).iterdir())
    assert [name.partition("-")[2] for name in names] == ["s2.jsonl", "s3.jsonl", "s4.jsonl"]


def test_a_full_file_still_takes_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, STATUS, None)
    monkeypatch.setattr(decision_log, "MAX_FILE_BYTES", 10)
    record(tmp_path, STATUS, None)
    record(tmp_path, ENDED, None)
    assert [json.loads(line)["state"] for line in lines(tmp_path)] == ["exploring", "found"]
