"""Each step of a search is a line that client and replay read; files are bounded, and survive a
crash."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from onemap import SearchSnapshot
from onemap_planner.search import decision_log
from onemap_planner.search.decision_log import FOLDER, Trail, file_name, past, read, record
from onemap_shared.messages import NO_CHOICE, SearchState, SearchStatus
from onemap_shared.wire import MAX_HEADER_BYTES, encode
from tests.shared.samples import sample

STATUS = replace(
    sample(SearchStatus), started_ns=10**18, updated_ns=10**18 + 9, elapsed_s=2.5, passed=()
)
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
    record(tmp_path, STATUS, (9.0, 9.0), always=True)
    record(tmp_path, ENDED, None)
    assert [json.loads(line)["state"] for line in lines(tmp_path)] == [
        "exploring",
        "exploring",
        "found",
    ]


def test_a_search_is_read_back_with_its_way(tmp_path: Path) -> None:
    trail = Trail()
    for place in ((0.0, 0.0), (0.1, 0.0), (0.3, 0.0), (0.6, 0.0)):
        trail.add(place[0] * 10, place)
    record(tmp_path, STATUS, (0.7, 0.0), trail.take())
    cut_off = past(tmp_path)[0]  # no end was recorded
    assert (cut_off.state, cut_off.results[-1].outcome) == (SearchState.INTERRUPTED,) * 2
    assert cut_off.reason.startswith("interrupted at 2001-09-09 01:46:40 UTC: the planner ended")
    assert cut_off.results[-1].name == "bed"
    record(tmp_path, ENDED, None, trail.take())
    assert past(tmp_path) == [replace(ENDED, choice=NO_CHOICE, start_m=())]
    known = read(tmp_path, "s1")
    assert known is not None
    xs = [0.0, 0.3, 0.6, 0.7]  # nearer ones are left out; the last is that of the step
    assert known.places[:, 1].tolist() == pytest.approx(xs)
    first, last = known.steps
    assert (first.target, first.robot_m, first.goal_m) == ("bed", (0.7, 0.0), (1.0, 2.0))
    assert (last.state, last.target, last.goal_kind) == (SearchState.FOUND, "", "frontier")
    assert read(tmp_path, "*") is None
    (tmp_path / FOLDER / file_name(STATUS)).write_text("no line of a search\n")
    assert (past(tmp_path), read(tmp_path, "s1")) == ([], None)


def test_a_long_search_is_thinned_but_for_its_turns(tmp_path: Path) -> None:
    trail = Trail()
    for number in range(500):
        for place in range(5):
            trail.add(number, (number + place / 5, float(place % 2)))
        turned = SearchState.APPROACHING if number == 351 else STATUS.state
        long = replace(STATUS, state=turned, reason=f"{number} " + "x" * 600)
        record(tmp_path, long, None, trail.take())
    record(tmp_path, ENDED, None, trail.take())
    known = read(tmp_path, "s1")
    assert known is not None
    assert len(encode(known).header) < MAX_HEADER_BYTES
    assert len(known.places) <= decision_log.MAX_PLACES
    assert len(known.steps) + known.left_out == 501
    assert known.steps[0].reason.startswith("0 ")
    assert [step.state for step in known.steps].count(SearchState.APPROACHING) == 1
    assert known.steps[-1].state is SearchState.FOUND
